#include <gtest/gtest.h>
#include <openvdb/openvdb.h>

#include <fstream>
#include <limits>
#include <random>
#include <span>

#include "common/field/kernel.hpp"
#include "common/volume/field_file.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon {
namespace {

using test::plain_block;
using test::straight_cut;

// Two bodies with cuts on all levels, and with leaves that are completely removed.
struct Cut2 {
  Case bone = plain_block(16.0, 8.0, 0.5);
  CutField parent{bone, {}}, piece{bone, {7}};
  Cut2() {
    for (int level = 0; level < kLevels; ++level) {
      Cut cut = straight_cut(*find_tool("burr-round-5"), {-3.0 + level, 0, -1}, {3, 2.0 * level, -2}, {0.1, 0, -1});
      cut.level = level;
      parent.apply(cut);
      cut.body = {7};
      if (level != 1) piece.apply(cut);
    }
  }
  [[nodiscard]] SavedFields saved() const {
    SavedFields fields{bone.hash(), kKernelVersion, {42}, bone.pitch_mm(), parent.leaves(), {{0}, {3}, {7}}};
    for (const FieldLeaf& leaf : piece.leaves()) fields.leaves.push_back(leaf);
    return fields;
  }
};

TEST(FieldFile, BringsBackTheSameBone) {
  const test::TempDir temp;
  const Cut2 scene;
  ASSERT_TRUE(save_fields(temp / "fields.vdb", scene.saved()));
  const auto loaded = load_fields(temp / "fields.vdb", scene.bone);
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_EQ(field_hash(loaded->leaves, 0.5), field_hash(scene.saved().leaves, 0.5));
  EXPECT_EQ(loaded->room_seq, RoomSeq{42});
  EXPECT_EQ(loaded->bodies, (std::vector<BodyId>{{0}, {3}, {7}}));
  CutField again(scene.bone, {});
  for (const FieldLeaf& leaf : loaded->leaves)
    if (leaf.body == BodyId{}) again.restore(leaf);
  EXPECT_EQ(again.hash(), scene.parent.hash());
  // Overwrites an older file. Nothing else is left in the folder.
  ASSERT_TRUE(save_fields(temp / "fields.vdb", scene.saved()));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(temp.path()), std::filesystem::directory_iterator()), 1);
}

TEST(FieldFile, KeepsTheSceneAndItsToolsBitForBit) {
  const test::TempDir temp;
  const Cut2 scene;
  SavedFields saved = scene.saved();
  Tool pin = *find_tool("pin-1");
  pin.name = "pin-of-ours";
  pin.diameter_mm += 0.1;
  saved.tools = {pin};
  for (const std::uint32_t id : {2u, 9u}) {
    SceneItem item;
    item.id = id;
    item.body = {3};
    item.tool = pin.hash();
    item.pose_bone_item = pose_along({1.0 / 3.0, -2.7, 1e-9}, Vec3{0.3, -0.5, id / 7.0});
    item.turns = id / 3.0;
    item.seated = id == 9;
    item.set_at = 77 + id;
    saved.items.push_back(item);
  }
  ASSERT_TRUE(save_fields(temp / "fields.vdb", saved));
  const auto loaded = load_fields(temp / "fields.vdb");
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_EQ(loaded->items, saved.items);
  ASSERT_EQ(loaded->tools.size(), 1u);
  EXPECT_EQ(loaded->tools[0].hash(), pin.hash());
}

TEST(FieldFile, IsAnOrdinaryVdbFileForOthers) {
  const test::TempDir temp;
  const Cut2 scene;
  ASSERT_TRUE(save_fields(temp / "fields.vdb", scene.saved()));
  openvdb::initialize();
  openvdb::io::File file((temp / "fields.vdb").string());
  file.open();
  ASSERT_TRUE(file.hasGrid("cuts.body0.level2"));
  EXPECT_TRUE(file.hasGrid("cuts.body7.level0"));
  EXPECT_FALSE(file.hasGrid("cuts.body7.level1"));
  const auto grid = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid("cuts.body0.level2"));
  ASSERT_TRUE(grid);
  EXPECT_DOUBLE_EQ(grid->voxelSize().x(), 0.125);
  // The distance is at its position in millimetres.
  for (const FieldLeaf& leaf : scene.parent.leaves())
    if (leaf.level == 2) {
      const openvdb::Coord at(leaf.origin.x + 1, leaf.origin.y + 2, leaf.origin.z + 3);
      EXPECT_EQ(grid->tree().getValue(at), static_cast<float>(leaf.value(64 + 16 + 3)) / 1024.0f);
    }
}

// Loads and returns the error.
Error refused(const std::filesystem::path& file, const Case* bone = nullptr) {
  const auto loaded = bone ? load_fields(file, *bone) : load_fields(file);
  EXPECT_FALSE(loaded);
  return loaded ? Error{} : loaded.error();
}

TEST(FieldFile, RefusesOthersInOneSentence) {
  const test::TempDir temp;
  const Cut2 scene;
  const auto save = [&](const SavedFields& fields) { ASSERT_TRUE(save_fields(temp / "fields.vdb", fields)); };
  EXPECT_EQ(refused(temp / "nothing.vdb").code, ErrorCode::not_found);

  SavedFields fields = scene.saved();
  fields.kernel_version = kKernelVersion + 1;
  save(fields);
  EXPECT_EQ(refused(temp / "fields.vdb").code, ErrorCode::unsupported);

  save(scene.saved());
  const Case other = plain_block(16.0, 8.5, 0.5);
  EXPECT_NE(refused(temp / "fields.vdb", &other).message.find("case"), std::string::npos);

  fields = scene.saved();
  fields.leaves[0].values[5] = static_cast<std::int16_t>(band_quanta(level_pitch_mm(0.5, fields.leaves[0].level)) + 1);
  save(fields);
  EXPECT_NE(refused(temp / "fields.vdb").message.find("no cut leaves"), std::string::npos);

  fields = scene.saved();
  fields.bodies = {{0}};
  save(fields);
  EXPECT_NE(refused(temp / "fields.vdb").message.find("cuts.body7"), std::string::npos);
}

// Writes what another program could write, with a seal as if it were ours.
void write_sealed(const std::filesystem::path& file, const openvdb::GridPtrVec& grids, const openvdb::MetaMap& meta) {
  openvdb::io::File(file.string()).write(grids, meta);
  std::ifstream in(file, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), {});
  Hasher hasher;
  hasher.bytes(std::as_bytes(std::span(bytes)));
  const Digest digest = hasher.finish();
  std::ofstream out(file, std::ios::binary | std::ios::app);
  out << "osteon-fields-1\n" << std::string(digest.bytes.begin(), digest.bytes.end());
}

TEST(FieldFile, RefusesValuesBetweenTheQuanta) {
  const test::TempDir temp;
  const Cut2 scene;
  ASSERT_TRUE(save_fields(temp / "fields.vdb", scene.saved()));
  openvdb::io::File file((temp / "fields.vdb").string());
  file.open(false);
  const auto grids = file.getGrids();
  const openvdb::MetaMap meta = *file.getMetadata();
  file.close();
  write_sealed(temp / "same.vdb", *grids, meta);
  EXPECT_TRUE(load_fields(temp / "same.vdb", scene.bone));
  const auto grid = openvdb::gridPtrCast<openvdb::FloatGrid>(grids->front());
  auto leaf = grid->tree().beginLeaf();
  leaf->setValueOn(0, 0.25f + 0.25f / 1024.0f);
  write_sealed(temp / "changed.vdb", *grids, meta);
  EXPECT_NE(refused(temp / "changed.vdb").message.find("no cut leaves"), std::string::npos);
  leaf->setValueOn(0, std::numeric_limits<float>::quiet_NaN());
  write_sealed(temp / "nan.vdb", *grids, meta);
  EXPECT_NE(refused(temp / "nan.vdb").message.find("no cut leaves"), std::string::npos);
  leaf->setValueOn(0, 0.25f);
  grid->tree().addTile(3, openvdb::Coord(0, 0, 0), 0.0f, true);
  write_sealed(temp / "tile.vdb", *grids, meta);
  EXPECT_NE(refused(temp / "tile.vdb").message.find("larger than any bone"), std::string::npos);
  openvdb::MetaMap none;
  write_sealed(temp / "nameless.vdb", *grids, none);
  EXPECT_EQ(refused(temp / "nameless.vdb").code, ErrorCode::invalid_input);
  // A case's own file is not a file of fields.
  ASSERT_TRUE(scene.bone.save(temp / "case"));
  EXPECT_EQ(refused(temp / "case" / "bone.vdb").code, ErrorCode::invalid_input);
}

// Bytes changed or cut off anywhere cause an error.
TEST(FieldFile, RefusesEveryDamage) {
  const test::TempDir temp;
  const Cut2 scene;
  ASSERT_TRUE(save_fields(temp / "fields.vdb", scene.saved()));
  std::ifstream in(temp / "fields.vdb", std::ios::binary);
  const std::string whole((std::istreambuf_iterator<char>(in)), {});
  std::mt19937 random(3);
  for (int i = 0; i < 100; ++i) {
    std::string bytes = whole;
    if (i % 2)
      bytes.resize(random() % bytes.size());
    else
      bytes[random() % (i % 4 ? bytes.size() : 600)] ^= static_cast<char>(1u << (random() % 8));
    std::ofstream(temp / "damaged.vdb", std::ios::binary) << bytes;
    const auto loaded = load_fields(temp / "damaged.vdb");
    ASSERT_FALSE(loaded);
    EXPECT_EQ(loaded.error().code, ErrorCode::invalid_input);
  }
}

}  // namespace
}  // namespace osteon
