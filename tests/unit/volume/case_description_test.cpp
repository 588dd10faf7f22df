// What case.json says, and its share in the hash of a case.
#include "common/volume/case_description.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "tests/support/content.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/support/scenes/described_case.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

TEST(CaseDescription, EveryFieldComesBack) {
  const test::TempDir temp;
  const CaseScan scan = test::turned_scan();
  const auto bone = test::described_ball(test::full_description(scan));
  ASSERT_TRUE(bone) << bone.error().message;
  ASSERT_TRUE(bone->save(temp / "case", scan));
  const auto loaded = Case::load(temp / "case");
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_EQ(loaded->info(), bone->info());
  EXPECT_EQ(loaded->info(), test::full_description(scan));
  EXPECT_EQ(loaded->hash(), bone->hash());
}

TEST(CaseDescription, IsEmptyWhereNothingIsKnown) {
  const test::TempDir temp;
  const Case bone = test::plain_block(4.0, 3.0, 1.0);
  ASSERT_TRUE(bone.save(temp / "case"));
  const auto loaded = Case::load(temp / "case");
  ASSERT_TRUE(loaded);
  EXPECT_EQ(loaded->info().schema_version, 2);
  EXPECT_FALSE(loaded->info().scan);
  // The lists may be left out.
  json described = json::parse(test::content(temp / "case" / "case.json"));
  for (const char* list : {"labels", "tissues", "landmarks", "axes", "planes", "regions"})
    EXPECT_EQ(described.erase(list), 1u) << list;
  std::ofstream(temp / "case" / "case.json") << described;
  const auto without = Case::load(temp / "case");
  ASSERT_TRUE(without) << without.error().message;
  EXPECT_EQ(without->hash(), bone.hash());
}

// Both hashes were printed by the code of commit a6e65f70, which knew only schema 1. The text below is what it wrote.
TEST(CaseDescription, ACaseOfSchema1LoadsWithTheHashThatItAlwaysHad) {
  struct Known {
    Case bone;
    std::string hash;
  };
  const auto half_metal = [](const Vec3& p) { return p.z() < -3 ? Tissue::metal : Tissue::none; };
  const Known known[] = {
      {test::plain_block(4.0, 3.0, 1.0), "b16fc2c8efc4cf776279691e0295678df32dd77503233ed4502699a2179dbb79"},
      {test::marked_block(8.0, 6.0, 1.0, half_metal),
       "8113a1420361772a237d1d19ff4d584e85478415cdcf4affa6cc5abd4689d988"},
  };
  for (const auto& [bone, hash] : known) {
    const test::TempDir temp;
    ASSERT_TRUE(bone.save(temp / "case"));
    const std::string text = R"({
  "calibration": {
    "intercept_g_cm3": 0.0,
    "slope_g_cm3_per_hu": 0.0
  },
  "content_hash": ")" + hash +
                             R"(",
  "pitch_mm": 1.0,
  "schema_version": 1,
  "segmentation": {
    "threshold_hu": 0.0
  },
  "source": "closed form",
  "title": "Test bone"
}
)";
    std::ofstream(temp / "case" / "case.json") << text;
    const auto loaded = Case::load(temp / "case");
    ASSERT_TRUE(loaded) << loaded.error().message;
    EXPECT_EQ(to_hex(loaded->hash()), hash);
    EXPECT_EQ(loaded->info().schema_version, 1);
    EXPECT_NE(bone.hash(), loaded->hash()) << "schema 2 has a hash of its own";
    // It stays a case of schema 1, as the server writes an uploaded case again.
    ASSERT_TRUE(loaded->save(temp / "again"));
    EXPECT_EQ(test::content(temp / "again" / "case.json"), text);
    EXPECT_TRUE(Case::load(temp / "again"));
    // A label that somebody adds is not of schema 1. It is neither read nor covered by the hash.
    json more = json::parse(text);
    more["labels"] = "anything";
    std::ofstream(temp / "case" / "case.json") << more;
    const auto ignored = Case::load(temp / "case");
    ASSERT_TRUE(ignored) << ignored.error().message;
    EXPECT_TRUE(ignored->info().labels.empty());
  }
}

// Both digests are those of another program that follows the order of the fields. The first is the description as it
// was hashed before a case could say how its density was found.
TEST(CaseDescription, WithoutProvenanceOfTheDensityTheHashIsWhatItWas) {
  CaseInfo info{.title = "Test bone",
                .source = "closed form",
                .pitch_mm = 0.5,
                .calibration = {0.001, 0.1},
                .threshold_hu = 226.0};
  const auto digest = [&] {
    Hasher hasher;
    hash_description(hasher, info);
    return to_hex(hasher.finish());
  };
  EXPECT_EQ(digest(), "dc64ebed08ecbcc0bf3b8276de3f1e026fbbb0e721015e38aae1fa6952069b72");
  info.density_from = {"given", {{"air_hu", -990.0}}, {"by hand"}};
  EXPECT_EQ(digest(), "8c9c22776e0a766ddb59d054c80e7ea85f9f5b8df864d855fc9dc30437be870d");
}

TEST(CaseDescription, TheHashChangesWithEachField) {
  const CaseScan scan = test::turned_scan();
  const CaseInfo full = test::full_description(scan);
  using Change = std::function<void(CaseInfo&)>;
  const std::vector<std::pair<const char*, Change>> changes{
      {"nothing", [](CaseInfo&) {}},
      {"title", [](CaseInfo& i) { i.title = "Another"; }},
      {"source", [](CaseInfo& i) { i.source = "Another"; }},
      {"slope", [](CaseInfo& i) { i.calibration.slope_g_cm3_per_hu = 0.002; }},
      {"intercept", [](CaseInfo& i) { i.calibration.intercept_g_cm3 = 0.2; }},
      {"no provenance of the density", [](CaseInfo& i) { i.density_from.reset(); }},
      {"method of the density", [](CaseInfo& i) { i.density_from->method = "given"; }},
      {"parameter of the density", [](CaseInfo& i) { i.density_from->parameters["cortical_error_g_cm3"] = 0.2; }},
      {"edit of the density", [](CaseInfo& i) { i.density_from->edits.clear(); }},
      {"threshold", [](CaseInfo& i) { i.threshold_hu = 227.0; }},
      {"no scan", [](CaseInfo& i) { i.scan.reset(); }},
      {"scan hash", [](CaseInfo& i) { i.scan->hash.bytes[31] ^= 1; }},
      {"scan dims", [](CaseInfo& i) { std::swap(i.scan->geometry.dims[0], i.scan->geometry.dims[1]); }},
      {"scan origin", [](CaseInfo& i) { i.scan->geometry.origin_mm.z() += 0.5; }},
      {"scan axes", [](CaseInfo& i) { i.scan->geometry.axes_mm(2, 1) += 0.01; }},
      {"label value", [](CaseInfo& i) { i.labels[0].value = 2; }},
      {"label name", [](CaseInfo& i) { i.labels[0].name = "bone 2"; }},
      {"label kind", [](CaseInfo& i) { i.labels[0].kind = LabelKind::soft_tissue; }},
      {"method", [](CaseInfo& i) { i.labels[0].provenance.method = "painted"; }},
      {"parameter", [](CaseInfo& i) { i.labels[0].provenance.parameters["threshold_hu"] = 227.0; }},
      {"more parameters", [](CaseInfo& i) { i.labels[0].provenance.parameters["sigma_mm"] = 0.0; }},
      {"edit", [](CaseInfo& i) { i.labels[1].provenance.edits[1] += "0"; }},
      {"order of edits",
       [](CaseInfo& i) { std::swap(i.labels[1].provenance.edits[0], i.labels[1].provenance.edits[1]); }},
      {"one label less", [](CaseInfo& i) { i.labels.erase(i.labels.begin()); }},
      {"one tissue less", [](CaseInfo& i) { i.tissues.pop_back(); }},
      {"tissue kind", [](CaseInfo& i) { i.tissues[1].kind = LabelKind::enamel; }},
      {"landmark name", [](CaseInfo& i) { i.landmarks[0].name = "x"; }},
      {"landmark", [](CaseInfo& i) { i.landmarks[0].point_mm.y() = 0.0; }},
      {"one landmark less", [](CaseInfo& i) { i.landmarks.pop_back(); }},
      {"axis name", [](CaseInfo& i) { i.axes[0].name = "x"; }},
      {"axis point", [](CaseInfo& i) { i.axes[0].point_mm.x() = 0.0; }},
      {"axis direction", [](CaseInfo& i) { i.axes[0].direction = Vec3::UnitX(); }},
      {"plane name", [](CaseInfo& i) { i.planes[0].name = "x"; }},
      {"plane point", [](CaseInfo& i) { i.planes[0].point_mm.x() = 0.0; }},
      {"plane normal", [](CaseInfo& i) { i.planes[0].normal = Vec3::UnitX(); }},
      {"region name", [](CaseInfo& i) { i.regions[0].name = "x"; }},
      {"region label", [](CaseInfo& i) { i.regions[0].label = 1; }},
      {"region min", [](CaseInfo& i) { i.regions[1].min_mm.x() = -9.0; }},
      {"region max", [](CaseInfo& i) { i.regions[1].max_mm.x() = 9.0; }},
  };
  std::set<Digest> seen;
  for (const auto& [what, change] : changes) {
    CaseInfo info = full;
    change(info);
    const auto bone = test::described_ball(info);
    ASSERT_TRUE(bone) << what << ": " << bone.error().message;
    EXPECT_TRUE(seen.insert(bone->hash()).second) << what << " is not in the hash";
  }
  CaseInfo finer = full;
  finer.pitch_mm = 0.25;
  EXPECT_TRUE(seen.insert(test::described_ball(finer)->hash()).second);
}

// The message names the file, the field and the remedy.
class WrongDescription : public ::testing::Test {
 protected:
  WrongDescription() {
    const CaseScan scan = test::turned_scan();
    const auto bone = test::described_ball(test::full_description(scan));
    EXPECT_TRUE(bone && bone->save(temp_ / "case", scan));
    sound_ = json::parse(test::content(file_));
  }
  void expect_refused(const json& described, const std::string& named, const std::string& what) {
    std::ofstream(file_) << described;
    const auto loaded = Case::load(temp_ / "case");
    ASSERT_FALSE(loaded) << named;
    EXPECT_EQ(loaded.error().code, ErrorCode::invalid_input);
    EXPECT_EQ(loaded.error().message, file_.string() + ": " + named + " " + what + "; import the case again");
  }
  void expect_refused(const char* pointer, const json& value, const std::string& named, const std::string& what) {
    json described = sound_;
    described[json::json_pointer(pointer)] = value;
    expect_refused(described, named, what);
  }

  test::TempDir temp_;
  const fs::path file_ = temp_ / "case" / "case.json";
  json sound_;
};

TEST_F(WrongDescription, EachFieldIsNamed) {
  const json inf = json::parse("1e300");
  expect_refused("/pitch_mm", 0, "pitch_mm", "must be above zero");
  expect_refused("/title", 3, "title", "is not a text");
  expect_refused("/calibration", 3, "calibration", "is not an object");
  expect_refused("/calibration/provenance", 3, "calibration.provenance", "is not an object");
  expect_refused("/calibration/provenance/method", "", "calibration.provenance.method", "is empty");
  expect_refused("/calibration/provenance/parameters/cortical_error_g_cm3", "one",
                 "calibration.provenance.parameters.cortical_error_g_cm3", "is not a number");
  expect_refused("/content_hash", "zz", "content_hash",
                 "is not a hash: " + digest_from_hex("zz").error().message.substr(0, 60));
  expect_refused("/scan/frame", "RAS", "scan.frame", "is not LPS");
  expect_refused("/scan/dims", json::array({1, 2}), "scan.dims", "does not have three entries");
  expect_refused("/scan/dims/1", 0, "scan.dims", "has a number that is not from 1 to 16384");
  expect_refused("/scan/dims/1", 1.5, "scan.dims[1]", "is not a whole number");
  expect_refused("/scan/dims/1", 4294967297, "scan.dims", "has a number that is not from 1 to 16384");
  expect_refused("/scan/dims", json::array({16384, 16384, 3}), "scan.dims", "has more than 2^29 voxels");
  expect_refused("/scan/origin_mm/0", inf, "scan.origin_mm", "is not three numbers within 100 m");
  expect_refused("/scan/axes_mm/2", json::array({0, 0, 0}), "scan.axes_mm[2]", "is not a step of 0.001 to 1000 mm");
  expect_refused("/scan/axes_mm", json::array({{1, 0, 0}, {0, 1, 0}, {1, 1, 0}}), "scan.axes_mm",
                 "has three steps in one plane");
  expect_refused("/labels/0/value", 0, "labels[0].value", "is not a number from 1 to 255");
  expect_refused("/labels/0/value", 256, "labels[0].value", "is not a number from 1 to 255");
  expect_refused("/labels/0/value", -1, "labels[0].value", "is not a number from 1 to 255");
  expect_refused("/labels/1/value", 1, "labels[1].value", "1 occurs twice");
  expect_refused("/labels/1/name", "", "labels[1].name", "is empty");
  expect_refused("/labels/1/name", "bone 1", "labels[1].name", "\"bone 1\" occurs twice");
  expect_refused("/labels/1/name", std::string(201, 'x'), "labels[1].name", "is longer than 200 bytes");
  expect_refused("/labels/1/name", "two\nlines", "labels[1].name", "has control characters");
  expect_refused("/labels/1/kind", "tooth", "labels[1].kind",
                 "is \"tooth\", which is none of bone, cortical, cancellous, metal, enamel, cartilage, nerve, vessel, "
                 "dura, soft_tissue");
  expect_refused("/labels/1/provenance", nullptr, "labels[1].provenance", "is not an object");
  expect_refused("/labels/1/provenance/method", "", "labels[1].provenance.method", "is empty");
  expect_refused("/labels/1/provenance/edits", 3, "labels[1].provenance.edits", "is not a list");
  expect_refused("/labels/1/provenance/edits/1", 3, "labels[1].provenance.edits[1]", "is not a text");
  expect_refused("/labels/1/provenance/edits/1", "", "labels[1].provenance.edits[1]", "is empty");
  expect_refused("/labels/0/provenance/parameters/island", "one", "labels[0].provenance.parameters.island",
                 "is not a number");
  expect_refused("/tissues/0/value", 2, "tissues[1].value", "2 occurs twice");
  expect_refused("/landmarks/1/name", "head centre", "landmarks[1].name", "\"head centre\" occurs twice");
  expect_refused("/landmarks/1/point_mm/2", inf, "landmarks[1].point_mm", "is not three numbers within 100 m");
  expect_refused("/landmarks/1/point_mm/2", "3", "landmarks[1].point_mm[2]", "is not a number");
  expect_refused("/axes/0/direction/2", 0.9, "axes[0].direction", "is not a unit vector");
  expect_refused("/axes/0/point_mm", 1, "axes[0].point_mm", "is not a list");
  expect_refused("/planes/0/normal/2", 0, "planes[0].normal", "is not a unit vector");
  expect_refused("/regions/0/label", 3, "regions[0].label", "is 3, which labels does not list");
  expect_refused("/regions/0/label", 0, "regions[0].label", "is 0, which is no label");
  expect_refused("/regions/1/max_mm/1", -2, "regions[1].min_mm", "is not below max_mm on every axis");
  expect_refused("/regions", json::object(), "regions", "is not a list");
}

TEST_F(WrongDescription, EachMissingFieldIsNamed) {
  for (const char* pointer : {"/title",
                              "/source",
                              "/pitch_mm",
                              "/calibration",
                              "/calibration/intercept_g_cm3",
                              "/calibration/provenance/edits",
                              "/segmentation/threshold_hu",
                              "/content_hash",
                              "/schema_version",
                              "/scan/hash",
                              "/scan/frame",
                              "/scan/dims",
                              "/scan/origin_mm",
                              "/scan/axes_mm",
                              "/labels/0/value",
                              "/labels/0/name",
                              "/labels/0/kind",
                              "/labels/0/provenance",
                              "/labels/0/provenance/method",
                              "/labels/0/provenance/parameters",
                              "/labels/0/provenance/edits",
                              "/landmarks/0/name",
                              "/landmarks/0/point_mm",
                              "/axes/0/direction",
                              "/planes/0/normal",
                              "/regions/1/min_mm"}) {
    json described = sound_;
    const json::json_pointer at(pointer);
    described[at.parent_pointer()].erase(at.back());
    std::string named(pointer + 1);
    for (const char* index : {"/0", "/1"})
      if (const auto found = named.find(index); found != std::string::npos)
        named.replace(found, 2, std::string("[") + index[1] + "]");
    std::ranges::replace(named, '/', '.');
    expect_refused(described, named, "is missing");
  }
}

TEST_F(WrongDescription, ListsHaveAnEnd) {
  json many = json::array();
  for (int i = 0; i <= 1000; ++i) many.push_back({{"name", std::to_string(i)}, {"point_mm", {0, 0, 0}}});
  expect_refused("/landmarks", many, "landmarks", "has more than 1000 entries");
}

TEST(CaseDescription, WhatIsNoNumberIsRefusedWhenACaseIsBuilt) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const auto refused = [](const std::function<void(CaseInfo&)>& change, const std::string& named) {
    CaseInfo info = test::full_description(test::turned_scan());
    change(info);
    const auto bone = test::described_ball(info);
    ASSERT_FALSE(bone) << named;
    EXPECT_EQ(bone.error().code, ErrorCode::invalid_input);
    EXPECT_NE(bone.error().message.find(named), std::string::npos) << bone.error().message;
  };
  refused([](CaseInfo& i) { i.threshold_hu = kNan; }, "threshold_hu");
  refused([](CaseInfo& i) { i.calibration.slope_g_cm3_per_hu = kNan; }, "calibration");
  refused([](CaseInfo& i) { i.landmarks[0].point_mm.x() = kNan; }, "landmarks[0].point_mm");
  refused([](CaseInfo& i) { i.axes[0].direction.x() = kNan; }, "axes[0].direction");
  refused([](CaseInfo& i) { i.planes[0].normal = Vec3::Zero(); }, "planes[0].normal");
  refused([](CaseInfo& i) { i.regions[1].min_mm.x() = kNan; }, "regions[1].min_mm");
  refused([](CaseInfo& i) { i.scan->geometry.axes_mm(0, 0) = kNan; }, "scan.axes_mm[0]");
  refused([](CaseInfo& i) { i.labels[0].provenance.parameters["island"] = kNan; }, "labels[0].provenance.parameters");
  refused([](CaseInfo& i) { i.labels[0].name = "\xff"; }, "UTF-8");
  refused([](CaseInfo& i) { i.schema_version = 1; }, "schema_version is 1, which has neither scan");
  refused([](CaseInfo& i) { i.schema_version = 3; }, "schema_version");
  refused([](CaseInfo& i) { i.title = std::string(2 << 20, 'x'); }, "longer than 1 MiB");
}

}  // namespace
}  // namespace osteon
