// Registering two scans, from their files to the files of the result. Both scans are made of one body, and the result's
// files are read by a reader of the test.
#include "server/import/scan_registration.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <numbers>

#include "server/import/registration_files.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/import/fixtures.hpp"
#include "tests/unit/import/label_files.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

const fs::path kRegisterProgram = OSTEON_IMPORT_PROGRAM;
const Vec3 kMiddle(10, -40, 200);

Pose turned(double degrees, const Vec3& axis, const Vec3& shift = Vec3::Zero()) {
  return {shift, Eigen::Quaterniond(Eigen::AngleAxisd(degrees * std::numbers::pi / 180.0, axis.normalized()))};
}

// The moving scan seen from the fixed one.
const Pose kTruth = turned(9.0, {2, -1, 1}, {-4, 12, -25});

// Three balls of bone of unequal size in a ball of soft tissue.
int body_hu(const Vec3& at) {
  const auto step = [](double outside_mm) { return 0.5 - 0.5 * std::tanh(outside_mm); };
  const Vec3 p = at - kMiddle;
  const double flesh = step(p.norm() - 21.0);
  const double bone = std::max({step((p - Vec3(-8, 2, -6)).norm() - 7.0), step((p - Vec3(9, 5, 2)).norm() - 5.0),
                                step((p - Vec3(1, -9, 9)).norm() - 6.0)});
  return static_cast<int>(std::lround(-1000.0 + 1050.0 * flesh + 900.0 * bone));
}
int body_label(const Vec3& at) {
  const Vec3 p = at - kMiddle;
  if ((p - Vec3(-8, 2, -6)).norm() < 7.0) return 700;
  return (p - Vec3(9, 5, 2)).norm() < 5.0 ? 2 : 0;
}

TestGrid grid_at(const Vec3& middle, double degrees) {
  TestGrid grid{.dims = {32, 30, 26}, .origin_mm = {}, .axes_mm = {}};
  grid.axes_mm = turned(degrees, {1, 0.3, -0.5}).rotation.toRotationMatrix() * Vec3(1.5, 1.5, 1.9).asDiagonal();
  grid.origin_mm = middle - grid.axes_mm * Vec3(15.5, 14.5, 12.5);
  return grid;
}
const TestGrid kFixed = grid_at(kMiddle, 20.0), kMoving = grid_at(kTruth.inverse().point(kMiddle), -12.0);

int moving_hu(const Vec3& at) { return body_hu(kTruth.point(at)); }

CtScan fixed_scan() { return scan_of(kFixed, body_hu); }
CtScan moving_scan() { return scan_of(kMoving, moving_hu); }

std::vector<NamedLandmark> landmarks(double wrong_mm = 0.0) {
  std::vector<NamedLandmark> all;
  for (const Vec3& at : {Vec3(-8, 2, -6), Vec3(9, 5, 2), Vec3(1, -9, 9), Vec3(0, 10, -3)}) {
    const double sign = all.size() % 2 == 0 ? 1.0 : -1.0;
    all.push_back({"point " + std::to_string(all.size() + 1),
                   {kMiddle + at + wrong_mm * sign * Vec3(0.6, 0.0, 0.8), kTruth.inverse().point(kMiddle + at)}});
  }
  return all;
}

double degrees_off(const Pose& pose) {
  return pose.rotation.angularDistance(kTruth.rotation) * 180.0 / std::numbers::pi;
}
double mm_off(const Pose& pose) { return (pose.point(kTruth.inverse().point(kMiddle)) - kMiddle).norm(); }

TEST(ScanRegistration, BeginsWithLandmarks) {
  const auto made =
      register_scans(fixed_scan().volume, moving_scan().volume, landmarks(2.0), "points.yaml", keep_going);
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(made->start, RegistrationStart::landmarks);
  EXPECT_LT(degrees_off(made->found.pose_fixed_moving), 0.5);
  EXPECT_LT(mm_off(made->found.pose_fixed_moving), 0.75);
  ASSERT_EQ(made->landmarks.size(), 4u);
  for (const LandmarkResidual& landmark : made->landmarks)
    EXPECT_NEAR(landmark.at_result_mm, 2.0, 0.4) << "each was put 2 mm beside its place";
  const std::string text = registration_text(*made);
  EXPECT_NE(text.find("point 3"), std::string::npos) << text;
  EXPECT_EQ(text.find("warning"), std::string::npos) << text;
}

TEST(ScanRegistration, WithoutLandmarksItTriesSeveralStarts) {
  // 25 mm away the frames of both scans share little.
  const auto made = register_scans(fixed_scan().volume, moving_scan().volume, {}, "", keep_going);
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_NE(made->start, RegistrationStart::landmarks);
  EXPECT_LT(degrees_off(made->found.pose_fixed_moving), 0.5);
  EXPECT_LT(mm_off(made->found.pose_fixed_moving), 0.75);
  const auto same = register_scans(fixed_scan().volume, fixed_scan().volume, {}, "", keep_going);
  ASSERT_TRUE(same);
  EXPECT_EQ(same->start, RegistrationStart::as_they_lie);
}

TEST(ScanRegistration, WrongLandmarksAreOneSentence) {
  const auto refused = [](const std::vector<NamedLandmark>& wrong, const std::string& what) {
    const auto made = register_scans(fixed_scan().volume, moving_scan().volume, wrong, "points.yaml", keep_going);
    ASSERT_FALSE(made);
    EXPECT_TRUE(made.error().message.starts_with("points.yaml: ")) << made.error().message;
    expect_one_sentence(made.error(), what);
  };
  auto wrong = landmarks();
  wrong[1].at.fixed_mm.x() += 300.0;
  refused(wrong, "point 2 lies 2");
  wrong = landmarks();
  for (NamedLandmark& landmark : wrong) std::swap(landmark.at.fixed_mm, landmark.at.moving_mm);
  refused(wrong, "outside the fixed scan");
  wrong = landmarks();
  wrong[2].at.moving_mm.z() -= 90.0;
  refused(wrong, "outside the moving scan; correct its moving_mm");
  wrong = landmarks();
  for (NamedLandmark& landmark : wrong)
    landmark.at.fixed_mm = kMiddle + 0.4 * (landmark.at.fixed_mm - kMiddle).x() * Vec3(1, 1, 0);
  refused(wrong, "of the fixed scan lie on a line");
}

TEST(ScanRegistration, AWrongLandmarkIsNamed) {
  auto wrong = landmarks();
  wrong.push_back({"point 5", {kMiddle + Vec3(5, 5, 5), kTruth.inverse().point(kMiddle + Vec3(5, -7, 5))}});
  const auto made = register_scans(fixed_scan().volume, moving_scan().volume, wrong, "points.yaml", keep_going);
  ASSERT_TRUE(made) << made.error().message;
  ASSERT_FALSE(made->warnings.empty());
  EXPECT_TRUE(made->warnings[0].starts_with("landmark 5 is 12.0 mm from where")) << made->warnings[0];
}

TEST(ScanRegistration, LabelsOfAMapKeepTheirNumbers) {
  LabelMap map;
  map.file = "labels.nrrd";
  map.grid = fixed_scan().volume;
  map.segments = {{.number = 700, .name = "femur", .type = {}, .runs = {{2, 4, 1, 3, 0}}},
                  {.number = 1, .name = {}, .type = {}, .runs = {{5, 5, 1, 3, 0}}}};
  auto drawn = draw_labels(map, map.grid);
  ASSERT_TRUE(drawn) << drawn.error().message;
  EXPECT_EQ(drawn->values[map.grid.index(4, 1, 3)], 700);
  EXPECT_EQ(drawn->values[map.grid.index(5, 1, 3)], 1);
  EXPECT_EQ(drawn->values[map.grid.index(6, 1, 3)], 0);
  EXPECT_EQ(drawn->names, (std::vector<std::pair<int, std::string>>{{700, "femur"}}));
  map.segments[1].runs = {{4, 5, 1, 3, 0}};
  drawn = draw_labels(map, map.grid);
  ASSERT_FALSE(drawn);
  expect_one_sentence(drawn.error(), "in two structures");
  imaging::HuVolume elsewhere = map.grid;
  elsewhere.origin_mm.z() += 500.0;
  drawn = draw_labels(map, elsewhere);
  ASSERT_FALSE(drawn);
  expect_one_sentence(drawn.error(), "does not lie on the moving scan");
}

// A NIfTI-1 file by nifti1.h, with the axes of its sform, in LPS.
struct ReadNifti {
  std::array<int, 3> dims{};
  Eigen::Matrix3d axes_mm;
  Vec3 origin_mm;
  std::vector<int> values;
};
template <class T>
T at(const std::string& bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}
ReadNifti read_nifti(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  const std::string bytes = uncompressed({std::istreambuf_iterator<char>(in), {}});
  ReadNifti read;
  EXPECT_EQ(at<std::int32_t>(bytes, 0), 348);
  EXPECT_GT(at<std::int16_t>(bytes, 254), 0) << "an sform";
  for (std::size_t d = 0; d < 3; ++d) read.dims[d] = at<std::int16_t>(bytes, 42 + 2 * d);
  for (int r = 0; r < 3; ++r) {
    const std::size_t row = 280 + 16 * static_cast<std::size_t>(r);
    const float sign = r < 2 ? -1.0f : 1.0f;
    for (int c = 0; c < 3; ++c)
      read.axes_mm(r, c) = static_cast<double>(sign * at<float>(bytes, row + 4 * static_cast<std::size_t>(c)));
    read.origin_mm[r] = static_cast<double>(sign * at<float>(bytes, row + 12));
  }
  const auto begin = static_cast<std::size_t>(at<float>(bytes, 108));
  const std::int16_t type = at<std::int16_t>(bytes, 70);
  EXPECT_TRUE(type == 4 || type == 512) << type;  // int16, uint16
  for (std::size_t i = begin; i + 2 <= bytes.size(); i += 2)
    read.values.push_back(type == 4 ? at<std::int16_t>(bytes, i) : at<std::uint16_t>(bytes, i));
  return read;
}

class RegisterCommand : public ::testing::Test {
 protected:
  void SetUp() override {
    write_bytes(folder_ / "fixed.nii", nifti_file(kFixed, {4, 16, bytes_of<std::int16_t>(labels_of(kFixed, body_hu))}));
    write_bytes(folder_ / "moving.nii",
                nifti_file(kMoving, {4, 16, bytes_of<std::int16_t>(labels_of(kMoving, moving_hu))}));
    write_bytes(folder_ / "parts.nii",
                nifti_file(kMoving, {512, 16, bytes_of<std::uint16_t>(labels_of(kMoving, [](const Vec3& p) {
                                       return body_label(kTruth.point(p));
                                     }))}));
    std::ofstream points(folder_ / "points.yaml");
    points << "landmarks:\n";
    for (const NamedLandmark& landmark : landmarks(1.0)) {
      points << "  - {name: " << landmark.name;
      for (const bool fixed : {true, false}) {
        const Vec3& p = fixed ? landmark.at.fixed_mm : landmark.at.moving_mm;
        points << (fixed ? ", fixed_mm: [" : ", moving_mm: [") << p.x() << ", " << p.y() << ", " << p.z() << "]";
      }
      points << "}\n";
    }
  }
  [[nodiscard]] std::string path(const char* name) const { return (folder_ / name).string(); }
  test::TempDir folder_;
};

TEST_F(RegisterCommand, WritesTheTransformAndTheMovedScan) {
  const auto made =
      test::run(kRegisterProgram, {"register", path("fixed.nii"), path("moving.nii"), "--landmarks",
                                   path("points.yaml"), "--labels", path("parts.nii"), "--out", path("out")});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_NE(made.out.find("start      landmarks"), std::string::npos) << made.out;
  EXPECT_EQ(files_of(folder_ / "out").size(), 3u);

  std::ifstream file(folder_ / "out" / "registration.json");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  EXPECT_EQ(text.find("point 1"), std::string::npos) << "no name";
  EXPECT_EQ(text.find(".nii"), std::string::npos) << "no path";
  const auto json = nlohmann::json::parse(text);
  const auto vector = [](const nlohmann::json& v) { return Vec3(v.at(0), v.at(1), v.at(2)); };
  Eigen::Matrix3d rotation;
  for (int row = 0; row < 3; ++row) rotation.row(row) = vector(json.at("rotation").at(static_cast<std::size_t>(row)));
  const Vec3 centre = vector(json.at("centre_mm")), translation = vector(json.at("translation_mm"));
  for (const Vec3& p : {kMiddle, Vec3(kMiddle + Vec3(15, 0, 0)), Vec3(kMiddle + Vec3(0, 0, -15))}) {
    const Vec3 to = rotation * (kTruth.inverse().point(p) - centre) + centre + translation;
    EXPECT_LT((to - p).norm(), 0.75);
  }
  EXPECT_EQ(json.at("fixed").at("sha256").get<std::string>().size(), 64u);
  EXPECT_NE(json.at("fixed").at("sha256"), json.at("moving").at("sha256"));
  EXPECT_GT(json.at("mutual_information_nat").at("at_result"), json.at("mutual_information_nat").at("at_start"));
  EXPECT_EQ(json.at("landmarks").size(), 4u);
  EXPECT_EQ(json.at("landmarks").at(0).size(), 2u) << "residuals alone";

  const ReadNifti moved = read_nifti(folder_ / "out" / "moving.nii.gz"),
                  labels = read_nifti(folder_ / "out" / "labels.nii.gz");
  for (const ReadNifti* one : {&moved, &labels}) {
    EXPECT_EQ(one->dims, kFixed.dims);
    EXPECT_LT((one->axes_mm - kFixed.axes_mm).cwiseAbs().maxCoeff(), 1e-5);
    EXPECT_LT((one->origin_mm - kFixed.origin_mm).cwiseAbs().maxCoeff(), 1e-3);
    ASSERT_EQ(one->values.size(), kFixed.count());
  }
  // Where both scans have voxels the moved one looks like the fixed one.
  const std::vector<int> expected = labels_of(kFixed, body_hu), expected_labels = labels_of(kFixed, body_label);
  double difference_hu = 0.0;
  std::size_t count = 0, labelled = 0, agreeing = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    if (moved.values[i] != -1024) {
      difference_hu += std::abs(moved.values[i] - expected[i]);
      ++count;
    }
    if (expected_labels[i] == 0) continue;
    ++labelled;
    agreeing += labels.values[i] == expected_labels[i] ? 1 : 0;
  }
  EXPECT_GT(count, expected.size() / 2);
  EXPECT_LT(difference_hu / static_cast<double>(count), 25.0) << "of steps of 900 HU, by interpolation";
  EXPECT_GT(labelled, 300u);
  EXPECT_GT(static_cast<double>(agreeing), 0.85 * static_cast<double>(labelled));

  const auto ct = test::run(kRegisterProgram, {"ct", path("out/moving.nii.gz"), "--list"});
  EXPECT_EQ(ct.exit_code, 0) << ct.err;
  const auto labelled_ct = test::run(kRegisterProgram, {"ct", path("fixed.nii"), "--labels", path("out/labels.nii.gz"),
                                                        "--label-names", "700=femur,2=tibia", "--out", path("case")});
  ASSERT_EQ(labelled_ct.exit_code, 0) << labelled_ct.err;
  EXPECT_NE(labelled_ct.out.find("that of the CT, voxel for voxel"), std::string::npos) << labelled_ct.out;
}

TEST_F(RegisterCommand, RefusesInOneSentenceAndLeavesNothing) {
  const auto refused = [&](std::vector<std::string> arguments, const std::string& what) {
    arguments.insert(arguments.begin(), "register");
    arguments.insert(arguments.end(), {"--out", path("out")});
    const auto result = test::run(kRegisterProgram, arguments);
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_EQ(result.out, "");
    EXPECT_NE(result.err.find(what), std::string::npos) << result.err;
    // Lines of progress may come before it.
    const std::size_t sentence = result.err.find("osteon-import: ");
    ASSERT_NE(sentence, std::string::npos) << result.err;
    EXPECT_EQ(result.err.find('\n', sentence), result.err.size() - 1) << result.err;
    EXPECT_FALSE(fs::exists(folder_ / "out"));
  };
  const std::string fixed = path("fixed.nii"), moving = path("moving.nii");
  refused({path("none.nii"), moving}, "none.nii");
  refused({fixed, moving, "--landmarks", path("none.yaml")},
          "there is no file of landmarks " + path("none.yaml") + "; give the name of a YAML file");
  refused({fixed, moving, "--labels", path("none.nrrd")}, "none.nrrd");
  refused({fixed, moving, "--moving-axes", "LPS"},
          "--moving-axes is for raw numbers and PNG slices; give "
          "--moving-spacing too");
  refused({fixed, moving, "--fixed-series", "2"}, "--fixed-series is for DICOM");
  std::ofstream(folder_ / "two.yaml") << "landmarks: [{fixed_mm: [1, 2, 3], moving_mm: [1, 2, 3]}]";
  refused({fixed, moving, "--landmarks", path("two.yaml")}, "has 1 landmark; write at least 3");
  fs::create_directory(folder_ / "taken");
  const auto taken = test::run(kRegisterProgram, {"register", fixed, moving, "--out", path("taken")});
  EXPECT_EQ(taken.exit_code, 1);
  EXPECT_NE(taken.err.find("already there"), std::string::npos) << taken.err;
}

TEST_F(RegisterCommand, StopsAtEveryStageAndLeavesNothing) {
  const CtScan fixed = fixed_scan(), moving = moving_scan();
  long calls = 0;
  const auto made = register_scans(fixed.volume, moving.volume, {}, "", [&](double) { return ++calls > 0; });
  ASSERT_TRUE(made);
  for (const double part : {0.0, 0.1, 0.5, 0.9}) {
    long left = static_cast<long>(part * static_cast<double>(calls));
    const auto stopped = register_scans(fixed.volume, moving.volume, {}, "", [&](double) { return --left >= 0; });
    ASSERT_FALSE(stopped) << part;
    EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
  }
  DrawnLabels labels{
      .grid = moving.volume, .values = std::vector<std::uint16_t>(moving.volume.count(), 3), .names = {}};
  for (const double until : {0.0, 0.2, 0.65, 0.8, 0.95}) {
    const auto stopped = write_registration(folder_ / "out", *made, fixed.volume, moving.volume, labels,
                                            [&](double done) { return done < until; });
    ASSERT_FALSE(stopped) << until;
    EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
    EXPECT_EQ(files_of(folder_.path()).size(), 4u) << "scans, labels and landmarks alone";
  }
  EXPECT_TRUE(write_registration(folder_ / "out", *made, fixed.volume, moving.volume, labels, keep_going));
}

}  // namespace
}  // namespace osteon::import
