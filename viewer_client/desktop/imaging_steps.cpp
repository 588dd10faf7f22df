#include "viewer_client/desktop/imaging_steps.hpp"

#include <QFile>
#include <QFileInfo>
#include <QJsonArray>
#include <QJsonDocument>
#include <QJsonObject>
#include <QLocale>
#include <QSaveFile>
#include <cstdint>
#include <limits>
#include <system_error>
#include <utility>

#include "viewer_client/desktop/stale_files.hpp"

namespace osteon {

namespace {

constexpr const char* kVoxelFile = "scan.nrrd";
constexpr const char* kFilteredFiles[] = {"filtered-1.nrrd", "filtered-2.nrrd"};
constexpr const char* kIslandFile = "islands.nrrd";
constexpr const char* kEdgeFile = "edges.nrrd";
constexpr const char* kKeptFile = "kept.nrrd";
constexpr const char* kBoxFile = "box.edits.yaml";
constexpr const char* kPictures = "pictures";
constexpr int kIslandPicture_px = 56;  // as the list shows them on a screen of double density
// Files with one scan by the ends of their names. What is inside decides in osteon-import.
constexpr const char* kOneScan[] = {".nii", ".nii.gz", ".nrrd", ".nhdr", ".mha", ".mhd", ".inv3"};

bool has_one_scan(const QString& source) {
  if (!QFileInfo(source).isFile()) return false;
  for (const char* end : kOneScan)
    if (source.endsWith(end, Qt::CaseInsensitive)) return true;
  return false;
}

QStringList options_of(const ScanFilter& filter) {
  QStringList options;
  for (const std::string& option : filter_options(filter)) options << QString::fromStdString(option);
  return options;
}

QString number_text(double value) { return QLocale().toString(value, 'g', 3); }

ListedSeries listed_series(const QJsonObject& of, int taken, const QString& pictures) {
  ListedSeries series;
  series.number = of["number"].toInt();
  series.largest = series.number == taken;
  series.problem = of["problem"].toString();
  series.picture = pictures + QString("/series-%1.png").arg(series.number);
  series.hu = pictures + QString("/series-%1.nrrd").arg(series.number);
  series.slices = of["slices"].toInt();
  const QJsonArray spacing = of["spacing_mm"].toArray();
  QString what = (series.slices == 1 ? QCoreApplication::translate("ImagingSteps", "CT, 1 slice, %1 × %2 pixels")
                                     : QCoreApplication::translate("ImagingSteps", "CT, %3 slices, %1 × %2 pixels"))
                     .arg(of["columns"].toInt())
                     .arg(of["rows"].toInt());
  if (series.slices != 1) what = what.arg(series.slices);
  if (spacing.size() == 3 && spacing[2].toDouble() > 0.0)
    what += QCoreApplication::translate("ImagingSteps", ", pitch %1 × %2 × %3 mm")
                .arg(number_text(spacing[0].toDouble()), number_text(spacing[1].toDouble()),
                     number_text(spacing[2].toDouble()));
  const QString description = of["description"].toString();
  series.text = (description.isEmpty() ? QCoreApplication::translate("ImagingSteps", "Series %1").arg(series.number)
                                       : description) +
                '\n' + what;
  if (!series.problem.isEmpty()) series.text += '\n' + series.problem;
  return series;
}

std::vector<ListedIsland> listed_islands(const QString& said, std::vector<IslandPicture> pictures) {
  std::vector<ListedIsland> islands;
  for (const auto& value : QJsonDocument::fromJson(said.toUtf8()).object()["islands"].toArray()) {
    const QJsonObject of = value.toObject();
    const QJsonArray at = of["centre_mm"].toArray();
    const int number = of["number"].toInt();
    if (number < 1 || number > std::numeric_limits<std::uint8_t>::max()) continue;  // voxels have a byte for it
    islands.push_back({number, of["kind"].toString().toStdString(), of["volume_cm3"].toDouble(),
                       of["density_g_cm3"].toDouble(), Vec3(at[0].toDouble(), at[1].toDouble(), at[2].toDouble()),
                       std::move(pictures[static_cast<std::size_t>(number)])});
  }
  return islands;
}

}  // namespace

// StaleFiles knows a folder of this name as that of a program that was killed.
ImagingSteps::ImagingSteps(Events events)
    : events_(std::move(events)),
      scratch_(cases_folder() / (".partial-imaging-" + std::to_string(QCoreApplication::applicationPid()))),
      shown_file_(kVoxelFile) {}

ImagingSteps::~ImagingSteps() {
  cancelled_ = true;
  if (loader_) loader_->wait();
  run_.reset();
  if (!boxes_.empty()) remove_partials(boxes_);  // a run that does not end in time is killed
  const bool unfinished = maker_ != nullptr;
  maker_.reset();
  std::error_code ignored;
  if (unfinished && !is_case(out_)) {
    std::filesystem::remove(edit_list_of(out_), ignored);
    std::filesystem::remove_all(report_folder(out_), ignored);
  }
  std::filesystem::remove_all(scratch_, ignored);
}

QString ImagingSteps::scratch_file(const char* name) const { return text_of(scratch_ / name); }

// Only the user may read it: it has a patient's scan.
bool ImagingSteps::make_scratch() {
  std::error_code error;
  std::filesystem::remove_all(scratch_, error);
  std::filesystem::create_directories(scratch_, error);
  if (!error) std::filesystem::permissions(scratch_, std::filesystem::perms::owner_all, error);
  return !error;
}

void ImagingSteps::cancel() {
  cancelled_ = true;
  if (run_) run_->cancel();
  if (maker_) maker_->cancel();
}

void ImagingSteps::fail(const QString& sentence) {
  QFile::remove(scratch_file(kKeptFile));  // it may be what fills the disk
  // The user knows the source, and not its copy.
  QString shown = sentence;
  for (const char* copy : {kVoxelFile, kFilteredFiles[0], kFilteredFiles[1]})
    shown.replace(scratch_file(copy), source_);
  events_.failed(cancelled_ ? QString() : shown);
}

void ImagingSteps::start(const QStringList& arguments, std::function<void(const QString& said)> done,
                         std::function<void()> undo) {
  cancelled_ = false;
  run_ = std::make_unique<ImporterRun>(
      arguments, scratch_file("log"),
      ImporterRun::Events{[this](int percent) { events_.progress(percent); },
                          [this, done = std::move(done), undo = std::move(undo)](const QString& said) {
                            run_.release()->deleteLater();
                            if (cancelled_ && undo) undo();
                            if (cancelled_) return fail({});
                            done(said);
                          },
                          [this](const QString& sentence) {
                            run_.release()->deleteLater();
                            fail(sentence);
                          }});
  run_->start();
}

void ImagingSteps::in_background(std::function<void()> work, std::function<void()> then) {
  loader_.reset(QThread::create(std::move(work)));
  connect(loader_.get(), &QThread::finished, this, [this, then = std::move(then)] {
    loader_.release()->deleteLater();
    if (!cancelled_) return then();
    scan_ = ShownScan();
    islands_ = IslandMap();
    edges_ = VoxelFile<std::uint8_t>();
    fail({});
  });
  loader_->start();
}

void ImagingSteps::open(const QString& source) {
  cancelled_ = false;
  source_ = source;
  if (!make_scratch())
    return fail(tr("Cannot make the folder %1. Choose a place where you may write.").arg(text_of(scratch_)));
  if (has_one_scan(source)) return read({});
  start({"series", source, "--json", "--with-hu", "--pictures", scratch_file(kPictures)},
        [this](const QString& said) { read_series(said); });
}

void ImagingSteps::read_series(const QString& said) {
  const QJsonObject report = QJsonDocument::fromJson(said.toUtf8()).object();
  std::vector<ListedSeries> series;
  for (const auto& value : report["series"].toArray())
    series.push_back(listed_series(value.toObject(), report["taken"].toInt(), scratch_file(kPictures)));
  if (series.empty()) return fail(tr("%1 has no CT series. Open another folder or file.").arg(source_));
  events_.listed(series);
}

void ImagingSteps::read(std::optional<int> series) {
  series_ = series;
  shown_file_ = kVoxelFile;
  QFile::remove(scratch_file(kVoxelFile));
  QStringList arguments{"export-scan", source_, scratch_file(kVoxelFile)};
  if (series) arguments << "--series" << QString::number(*series);
  start(arguments, [this](const QString&) { load(kVoxelFile, events_.read); });
}

void ImagingSteps::load(const char* file,
                        const std::function<void(ShownScan scan, const HuHistogram& histogram)>& then) {
  in_background(
      [this, file] {
        scan_ = read_scan_file(scratch_ / file);
        if (scan_) histogram_ = histogram_of(*scan_);
      },
      [this, file, then] {
        Result<ShownScan> scan = std::exchange(scan_, ShownScan());
        if (!scan) return fail(QString::fromStdString(scan.error().message));
        if (shown_file_ != file && shown_file_ != kVoxelFile) QFile::remove(scratch_file(shown_file_));
        shown_file_ = file;
        then(std::move(*scan), histogram_);
      });
}

void ImagingSteps::filter(const ScanFilter& filter) {
  cancelled_ = false;
  if (filter == ScanFilter{}) return load(kVoxelFile, events_.filtered);
  // The file that is shown stays until the new one is there: the filter may be cancelled.
  const char* file = kFilteredFiles[shown_file_ == kFilteredFiles[0] ? 1 : 0];
  QFile::remove(scratch_file(file));
  start(QStringList{"export-scan", scratch_file(kVoxelFile), scratch_file(file)} + options_of(filter),
        [this, file](const QString&) { load(file, events_.filtered); });
}

bool ImagingSteps::write_edits(const QString& file, const ImagingEdits& edits) {
  const QByteArray text = QByteArray::fromStdString(edit_list_text(edits));
  QSaveFile saved(file);
  if (saved.open(QIODevice::WriteOnly) && saved.write(text) == text.size() && saved.commit()) return true;
  fail(tr("Cannot write %1. Is the disk full?").arg(file));
  return false;
}

void ImagingSteps::find(const ScanGeometry& scan, const ImagingEdits& edits) {
  cancelled_ = false;
  QFile::remove(scratch_file(kIslandFile));
  QStringList arguments{"islands", scratch_file(shown_file_), scratch_file(kIslandFile), "--threshold",
                        QString::number(edits.threshold_hu, 'g', 17)};
  if (edits.box) {
    ImagingEdits box;
    box.box = edits.box;
    if (!write_edits(scratch_file(kBoxFile), box)) return;
    arguments << "--edits" << scratch_file(kBoxFile);
  }
  start(arguments, [this, scan](const QString& said) { read_islands(said, scan); });
}

void ImagingSteps::read_islands(const QString& said, const ScanGeometry& scan) {
  in_background(
      [this, scan] {
        auto numbers = read_number_file(scratch_ / kIslandFile);
        if (numbers) island_pictures_ = island_pictures(*numbers, kIslandPicture_px);
        islands_ =
            numbers ? IslandMap::make(scan, std::move(*numbers)) : Result<IslandMap>(tl::unexpected(numbers.error()));
      },
      [this, said] {
        Result<IslandMap> map = std::exchange(islands_, IslandMap());
        if (!map) return fail(QString::fromStdString(map.error().message));
        events_.found(listed_islands(said, std::move(island_pictures_)), std::move(*map));
      });
}

void ImagingSteps::find_edges(const ScanGeometry& scan) {
  cancelled_ = false;
  QFile::remove(scratch_file(kEdgeFile));
  start({"edges", scratch_file(shown_file_), scratch_file(kEdgeFile)}, [this, scan](const QString&) {
    in_background([this] { edges_ = read_number_file(scratch_ / kEdgeFile); },
                  [this, scan] {
                    auto edges = std::exchange(edges_, VoxelFile<std::uint8_t>());
                    if (!edges) return fail(QString::fromStdString(edges.error().message));
                    if (edges->geometry.dims != scan.dims)
                      return fail(tr("The edges are not those of the scan. Find them again."));
                    events_.edges(std::move(*edges));
                  });
  });
}

void ImagingSteps::write_boxes(const ScanGeometry& scan, const IslandMap& islands, const KeptParts& kept,
                               double threshold_hu, int subdivisions, const std::filesystem::path& folder) {
  cancelled_ = false;
  boxes_ = folder;
  const QStringList arguments{"report",         scratch_file(shown_file_),
                              "--bone",         scratch_file(kKeptFile),
                              "--threshold",    QString::number(threshold_hu, 'g', 17),
                              "--out",          text_of(folder),
                              "--subdivisions", QString::number(subdivisions)};
  in_background(
      [this, &scan, &islands, kept] {
        kept_ = write_kept(scratch_ / kKeptFile, scan, islands, kept, [this](double) { return !cancelled_; });
      },
      [this, arguments, folder] {
        if (!kept_) return fail(QString::fromStdString(kept_.error().message));
        start(
            arguments,
            [this, folder](const QString&) {
              QFile::remove(scratch_file(kKeptFile));
              events_.boxes_written(folder);
            },
            [folder] {  // osteon-import makes a new folder or ends with an error, so this one is its own
              std::error_code ignored;
              std::filesystem::remove_all(folder, ignored);
            });
      });
}

void ImagingSteps::make(const ImagingEdits& edits, bool with_report) {
  cancelled_ = false;
  out_ = new_case_folder(source_);
  const QString file = text_of(edit_list_of(out_));
  if (!write_edits(file, edits)) return;
  QStringList how{"ct", source_, "--threshold", QString::number(edits.threshold_hu, 'g', 17), "--edits", file};
  how << options_of(edits.filter);
  if (series_) how << "--series" << QString::number(*series_);
  if (with_report) how << "--report" << text_of(report_folder(out_));
  maker_ = std::make_unique<CaseMaker>(how, out_,
                                       CaseMaker::Events{[this](int percent) { events_.progress(percent); },
                                                         [this](const std::filesystem::path& bone) {
                                                           maker_.release()->deleteLater();
                                                           events_.made(bone);
                                                         },
                                                         [this, file](const QString& sentence) {
                                                           maker_.release()->deleteLater();
                                                           QFile::remove(file);  // the page has the edits
                                                           std::error_code ignored;
                                                           std::filesystem::remove_all(report_folder(out_), ignored);
                                                           fail(sentence);
                                                         }});
  maker_->start();
}

}  // namespace osteon
