// What the page of image processing costs with a folder of DICOM slices, on a screen of its own, with osteon-import as
// its child. `slice FOLDER`: from the folder to the first slice that is drawn, the middle one, with a person who
// chooses its only series at once, and to all three planes. The first slice is compared with what GDCM reads. `segment
// FOLDER`: memory while a person keeps parts, paints, erases, cuts, changes the threshold and the filter, and undoes
// and does all of it again. `decode FOLDER`: GDCM alone, which reads the headers and decodes every slice once. Prints
// JSON.
#include <QCheckBox>
#include <QComboBox>
#include <QDoubleSpinBox>
#include <QLabel>
#include <QListWidget>
#include <QPushButton>
#include <QSlider>
#include <QSpinBox>
#include <QTest>
#include <QToolButton>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "tests/integration/desk.hpp"
#include "tests/integration/window_bench.hpp"
#include "tests/perf/baselines/gdcm_decode.hpp"
#include "viewer_client/desktop/imaging_page.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr double kKbPerMb = 1024.0;
constexpr int kStrokes = 60;
constexpr std::size_t kGreysOfBone = 50;  // a plane that is drawn has more, an empty one a few
constexpr double kNearer = 0.95;          // the noise of the slices differs, their bone hardly
constexpr int kCompared = 3;              // each third voxel along both axes

// A line of a process's status, MB; 0 without it. `process`: a number, or "self".
double status_mb(const std::string& process, std::string_view line_name) {
  std::ifstream file("/proc/" + process + "/status");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with(line_name)) return std::stod(line.substr(line_name.size())) / kKbPerMb;
  return 0.0;
}

// The peaks of this process, and of it together with osteon-import, since begin().
class Memory {
 public:
  void begin() {
    std::ofstream("/proc/self/clear_refs") << "5";
    together_mb_ = 0.0;
  }
  void look() {
    double now_mb = status_mb("self", "VmRSS:");
    for (const pid_t importer : children("osteon-import")) now_mb += status_mb(std::to_string(importer), "VmRSS:");
    together_mb_ = std::max(together_mb_, now_mb);
  }
  [[nodiscard]] double peak_mb() const { return status_mb("self", "VmHWM:"); }
  [[nodiscard]] double together_mb() const { return std::max(together_mb_, peak_mb()); }

 private:
  double together_mb_ = 0.0;
};

std::size_t greys_of(const QImage& drawn) {
  std::set<int> greys;
  for (int y = 0; y < drawn.height(); ++y)
    for (int x = 0; x < drawn.width(); ++x) greys.insert(qGray(drawn.pixel(x, y)));
  return greys.size();
}

// The mean difference in greys of a picture of the plane from a slice in the window of bone, by DICOM's formula for a
// window of 2000 HU about 500 HU. The picture is smaller than the slice, so that pixels are compared with the mean of
// 3 x 3 voxels. `number`: of the slice that the plane is at.
double difference_of(const QImage& drawn, const ImagingPlane& plane, const baselines::GdcmSlice& slice, int number) {
  const auto grey = [&](int column, int row) {
    double sum = 0.0;
    for (int down = -1; down <= 1; ++down)
      for (int right = -1; right <= 1; ++right) {
        const double hu = slice.hu[static_cast<std::size_t>((row + down) * slice.columns + column + right)];
        sum += 255.0 * std::clamp((hu - 500.0) / 2000.0 + 0.5, 0.0, 1.0);
      }
    return sum / 9.0;
  };
  double sum = 0.0;
  int count = 0;
  for (int row = 1; row < slice.rows - 1; row += kCompared)
    for (int column = 1; column < slice.columns - 1; column += kCompared) {
      const QPoint at = plane.pixel({column, row, number});
      if (!drawn.valid(at)) return 255.0;
      sum += std::abs(qGray(drawn.pixel(at)) - grey(column, row));
      ++count;
    }
  return count > 0 ? sum / count : 255.0;
}

// Each step returns false, after a message, if the page did not do what it should.
class Reader {
 public:
  Reader()
      : page_({.busy = [](bool) {},
               .made = [](const std::filesystem::path&, const QString&) {},
               .may_send = [] { return false; },
               .send = [](const std::filesystem::path&) { return QString(); },
               .leave = [] {}}) {
    page_.resize(1280, 900);
    page_.show();
    (void)QTest::qWaitForWindowExposed(&page_, 30000);
  }
  bool opens(const std::string& folder, nlohmann::json& seen);
  // Whether the first slice that was drawn is the one in the middle by GDCM's places, and not one beside it.
  bool saw_the_middle(const std::string& folder, nlohmann::json& seen) const;
  bool segments(nlohmann::json& seen);

 private:
  template <class Widget>
  [[nodiscard]] Widget& part(const char* name) const {
    return *page_.findChild<Widget*>(name);
  }
  [[nodiscard]] ImagingPlane& plane() const { return dynamic_cast<ImagingPlane&>(part<QWidget>("plane_axial")); }
  [[nodiscard]] bool idle() const { return !part<QPushButton>("imaging_cancel").isVisible(); }
  template <class Condition>
  bool sees(const char* what, Condition condition) {
    const auto deadline = Clock::now() + 600s;
    while (!condition()) {
      if (Clock::now() > deadline) {
        std::fprintf(stderr, "osteon-imaging-page: %s did not come: %s\n", what,
                     part<QLabel>("imaging_words").text().toUtf8().constData());
        return false;
      }
      QTest::qWait(2);
      memory_.look();
    }
    return true;
  }
  bool finds_parts() {
    const auto& parts = part<QListWidget>("islands");
    return sees("the parts of bone", [&] { return idle() && parts.isEnabled() && parts.count() > 0; });
  }
  void click(const char* button) { QTest::mouseClick(&part<QAbstractButton>(button), Qt::LeftButton); }
  void drag(const QPoint& from, const QPoint& to);
  void corrects();
  bool undoes_all();
  template <class Step>
  bool measured(const char* what, nlohmann::json& seen, Step step);

  ImagingPage page_;
  Memory memory_;
  QImage first_;
};

bool Reader::opens(const std::string& folder, nlohmann::json& seen) {
  const auto begin = Clock::now();
  const auto ms = [&] { return std::chrono::duration<double, std::milli>(Clock::now() - begin).count(); };
  page_.open_source(QString::fromStdString(folder));
  auto& list = part<QListWidget>("series");
  if (!sees("the series", [&] { return idle() && list.isVisible() && list.count() == 1; })) return false;
  seen["listed_ms"] = ms();
  QTest::mouseClick(list.viewport(), Qt::LeftButton, {}, list.visualItemRect(list.item(0)).center());
  if (!sees("the first slice", [&] { return plane().isVisible(); })) return false;
  first_ = plane().grab().toImage();
  seen["slice_ms"] = ms();
  if (!sees("the slices", [&] { return plane().isEnabled(); })) return false;
  seen["read_ms"] = ms();
  std::vector<QImage> planes;
  for (const char* name : {"plane_axial", "plane_coronal", "plane_sagittal"})
    planes.push_back(part<QWidget>(name).grab().toImage());
  seen["planes_ms"] = ms();
  double voxels = 1.0;
  for (const char* slices : {"slice_axial", "slice_coronal", "slice_sagittal"})
    voxels *= part<QSlider>(slices).maximum() + 1;
  seen["volume_mb"] = voxels * sizeof(std::int16_t) / (kKbPerMb * kKbPerMb);
  const bool drawn = std::ranges::all_of(planes, [](const QImage& of) { return greys_of(of) >= kGreysOfBone; });
  if (!drawn) std::fprintf(stderr, "osteon-imaging-page: a plane is empty\n");
  return drawn;
}

bool Reader::saw_the_middle(const std::string& folder, nlohmann::json& seen) const {
  const int middle = (part<QSlider>("slice_axial").maximum() + 1) / 2;
  const auto difference = [&](int number) {
    return difference_of(first_, plane(), baselines::gdcm_slice(folder, static_cast<std::size_t>(number)), middle);
  };
  const double own = difference(middle), others = std::min(difference(middle - 1), difference(middle + 1));
  seen["difference"] = own;
  seen["difference_of_neighbours"] = others;
  if (own < kNearer * others) return true;
  std::fprintf(stderr, "osteon-imaging-page: the first slice is not that in the middle of the folder\n");
  return false;
}

void Reader::drag(const QPoint& from, const QPoint& to) {
  QTest::mousePress(&plane(), Qt::LeftButton, {}, from);
  for (int step = 1; step <= 8; ++step) {
    QMouseEvent move(QEvent::MouseMove, from + (to - from) * step / 8, Qt::NoButton, Qt::LeftButton, {});
    QApplication::sendEvent(&plane(), &move);
  }
  QTest::mouseRelease(&plane(), Qt::LeftButton, {}, to);
}

// Strokes and cuts all over the middle of the scan.
void Reader::corrects() {
  auto& slider = part<QSlider>("slice_axial");
  const int slices = slider.maximum() + 1, width = plane().width(), height = plane().height();
  part<QDoubleSpinBox>("brush_radius").setValue(6.0);
  for (int stroke = 0; stroke < kStrokes; ++stroke) {
    slider.setValue(slices * (stroke + 1) / (kStrokes + 2));
    click(stroke % 10 == 9 ? "tool_cut" : stroke % 2 == 0 ? "tool_paint" : "tool_erase");
    const QPoint from(width * (30 + stroke % 7) / 100, height * (30 + stroke % 11) / 100);
    drag(from, from + QPoint(width / 4, height / 5));
    memory_.look();
  }
  click("tool_look");
}

bool Reader::undoes_all() {
  const auto& undo = part<QPushButton>("undo_edit");
  while (undo.isEnabled()) {
    click("undo_edit");
    if (!sees("the parts after an undo", [&] { return idle(); })) return false;
  }
  return true;
}

template <class Step>
bool Reader::measured(const char* what, nlohmann::json& seen, Step step) {
  memory_.begin();
  const bool done = step();
  memory_.look();
  seen["steps"].push_back({{"what", what}, {"page_mb", memory_.peak_mb()}, {"together_mb", memory_.together_mb()}});
  return done;
}

bool Reader::segments(nlohmann::json& seen) {
  const auto& undo = part<QPushButton>("undo_edit");
  auto& parts = part<QListWidget>("islands");
  const auto keeps = [&] {
    for (int i = 0; i < std::min(parts.count(), 8); ++i) parts.item(i)->setCheckState(Qt::Checked);
    corrects();
    return undo.isEnabled();
  };
  const auto changes_threshold = [&] {
    part<QSpinBox>("threshold").setValue(300);
    return sees("a search", [&] { return !idle(); }) && finds_parts();
  };
  const auto filters = [&] {
    auto& filter = part<QComboBox>("filter");
    filter.setCurrentIndex(3);
    emit filter.activated(3);
    return finds_parts();
  };
  const auto redoes_all = [&] {
    const auto& redo = part<QPushButton>("redo_edit");
    while (redo.isEnabled()) {
      click("redo_edit");
      if (!finds_parts()) return false;
    }
    return true;
  };
  return measured("parts found", seen, [&] { return finds_parts(); }) && measured("kept and corrected", seen, keeps) &&
         measured("another threshold", seen, changes_threshold) && measured("a Gaussian", seen, filters) &&
         measured("all undone", seen, [&] { return undoes_all() && finds_parts(); }) &&
         measured("all done again", seen, redoes_all) &&
         measured("all undone again", seen, [&] { return undoes_all(); });
}

int decode(const std::string& folder) {
  const baselines::GdcmDecoded done = baselines::gdcm_decode(folder);
  std::printf("%s\n", nlohmann::json{{"slices", done.slices},
                                     {"volume_mb", static_cast<double>(done.bytes) / (kKbPerMb * kKbPerMb)},
                                     {"sum", done.sum},
                                     {"headers_ms", done.headers_ms},
                                     {"decode_ms", done.decode_ms}}
                          .dump()
                          .c_str());
  return 0;
}

int show(const std::string& folder, bool segments) {
  const Desk desk;
  if (!desk.stands()) {
    std::fprintf(stderr, "osteon-imaging-page: Xvfb, of Debian's package xvfb, did not start\n");
    return 1;
  }
  nlohmann::json seen{{"steps", nlohmann::json::array()}};
  Reader reader;
  seen["before_mb"] = status_mb("self", "VmRSS:");
  const bool done =
      reader.opens(folder, seen) && (segments ? reader.segments(seen) : reader.saw_the_middle(folder, seen));
  std::printf("%s\n", seen.dump().c_str());
  return done ? 0 : 1;
}

}  // namespace
}  // namespace osteon::test

int main(int argc, char** argv) try {
  const std::string_view what = argc == 3 ? argv[1] : "";
  if (what == "decode") return osteon::test::decode(argv[2]);
  if (what == "slice" || what == "segment") return osteon::test::show(argv[2], what == "segment");
  std::fprintf(stderr, "usage: osteon-imaging-page slice FOLDER | segment FOLDER | decode FOLDER\n");
  return 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "osteon-imaging-page: %s\n", error.what());
  return 1;
}
