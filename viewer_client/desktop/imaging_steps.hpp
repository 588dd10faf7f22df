// The steps from a CT to a case: list its series, read one, find its islands, make the case. osteon-import does each in
// a process of its own, so that the window never waits, and a damaged file ends only that process.
#pragma once
#include <QCoreApplication>
#include <QObject>
#include <QString>
#include <QStringList>
#include <QThread>
#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "viewer_client/desktop/importer_run.hpp"
#include "viewer_client/desktop/library.hpp"
#include "viewer_client/imaging/hu_histogram.hpp"
#include "viewer_client/imaging/imaging_edits.hpp"
#include "viewer_client/imaging/island_map.hpp"
#include "viewer_client/imaging/kept_slices.hpp"

namespace osteon {

// What a person chooses from.
struct ListedSeries {
  int number = 0;
  QString text;     // description, modality, slices, size and pitch
  QString problem;  // why it cannot be read; empty: it can
  QString picture;  // file of the middle slice; it may not be there
  QString hu;       // file of the HU of the same slice, number slices / 2 from 0; it may not be there
  int slices = 0;
  bool largest = false;
};

// [GUI thread] One step at a time. Its scratch files go when it goes.
class ImagingSteps : public QObject {
  Q_DECLARE_TR_FUNCTIONS(ImagingSteps)

 public:
  struct Events {
    std::function<void(int percent)> progress;
    std::function<void(const std::vector<ListedSeries>& series)> listed;
    std::function<void(ShownScan scan, const HuHistogram&histogram)> read, filtered;
    std::function<void(std::vector<ListedIsland> list, IslandMap map)> found;
    std::function<void(VoxelFile<std::uint8_t> edges)> edges;
    std::function<void(const std::filesystem::path& folder)> boxes_written;
    std::function<void(const std::filesystem::path& bone)> made;
    std::function<void(const QString& sentence)> failed;  // empty: cancelled
  };
  explicit ImagingSteps(Events events);
  ~ImagingSteps() override;

  [[nodiscard]] bool busy() const { return run_ || maker_ || loader_; }
  [[nodiscard]] bool making() const { return maker_ != nullptr; }
  void cancel();

  // A folder, zip, ISO image or slice has series. Any other file has one scan, which is read at once.
  void open(const QString& source);
  // A series that was listed.
  void read(std::optional<int> series);
  // The scan that was read, as it is after a filter: tells `filtered`.
  void filter(const ScanFilter& filter);
  // The islands of the filtered scan, by the edits' threshold and box.
  void find(const ScanGeometry& scan, const ImagingEdits& edits);
  // The edges of the filtered scan: tells `edges`.
  void find_edges(const ScanGeometry& scan);
  // The root sub-volumes of what is kept, in a folder that is not there yet, by "osteon-import report". Scan and
  // islands stay as they are until this ends. Tells `boxes_written`.
  void write_boxes(const ScanGeometry& scan, const IslandMap& islands, const KeptParts& kept, double threshold_hu,
                   int subdivisions, const std::filesystem::path& folder);
  // The case has the edit list beside it, in a file NAME.edits.yaml. With a report it has that in report_folder(), too.
  void make(const ImagingEdits& edits, bool with_report);

 private:
  // `undo`: for a run that was cancelled too late, after its work was done.
  void start(const QStringList& arguments, std::function<void(const QString& said)> done,
             std::function<void()> undo = {});
  void in_background(std::function<void()> work, std::function<void()> then);
  void fail(const QString& sentence);
  [[nodiscard]] bool make_scratch();
  [[nodiscard]] QString scratch_file(const char* name) const;
  void load(const char* file, const std::function<void(ShownScan scan, const HuHistogram& histogram)>& then);
  [[nodiscard]] bool write_edits(const QString& file, const ImagingEdits& edits);
  void read_series(const QString& said);
  void read_islands(const QString& said, const ScanGeometry& scan);

  Events events_;
  std::filesystem::path scratch_;
  QString source_;
  std::optional<int> series_;
  const char* shown_file_;              // in the scratch folder: the scan, or a filtered one
  std::filesystem::path out_;           // the case that is made
  std::filesystem::path boxes_;         // the folder of sub-volumes that was written last
  std::atomic<bool> cancelled_{false};  // the other thread asks, too
  std::unique_ptr<ImporterRun> run_;
  std::unique_ptr<CaseMaker> maker_;
  // The other thread writes these, and the GUI thread reads them when it has ended.
  Result<ShownScan> scan_;
  HuHistogram histogram_;  // of the scan
  Result<IslandMap> islands_;
  std::vector<IslandPicture> island_pictures_;
  Result<VoxelFile<std::uint8_t>> edges_;
  Result<void> kept_;
  std::unique_ptr<QThread> loader_;
};

}  // namespace osteon
