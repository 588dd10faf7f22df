#include "viewer_client/imaging/edit_history.hpp"

#include <gtest/gtest.h>

#include "server/import/edit_file.hpp"

namespace osteon {
namespace {

ImagingEdits with_seed(ImagingEdits edits, const Vec3& seed) {
  edits.seeds_mm.push_back(seed);
  return edits;
}

TEST(EditHistory, GoesBackAndForthThroughEverything) {
  EditHistory history;
  EXPECT_FALSE(history.can_undo());
  const ImagingEdits none = history.now(), one = with_seed(none, {1, 2, 3});
  ImagingEdits lower = one;
  lower.threshold_hu = 150.0;
  history.apply(one);
  history.apply(lower);
  EXPECT_EQ(history.now(), lower);
  EXPECT_FALSE(history.can_redo());
  history.undo();
  EXPECT_EQ(history.now(), one);
  history.undo();
  EXPECT_EQ(history.now(), none);
  history.undo();
  EXPECT_EQ(history.now(), none);
  history.redo();
  history.redo();
  history.redo();
  EXPECT_EQ(history.now(), lower);
}

TEST(EditHistory, ANewEditTakesThePlaceOfWhatWasUndone) {
  EditHistory history;
  const ImagingEdits none = history.now();
  history.apply(with_seed(none, {1, 2, 3}));
  history.undo();
  history.apply(with_seed(none, {4, 5, 6}));
  EXPECT_FALSE(history.can_redo());
  history.undo();
  EXPECT_EQ(history.now(), none);
}

TEST(EditHistory, AnEditThatChangesNothingIsNoStep) {
  EditHistory history;
  history.apply(history.now());
  EXPECT_FALSE(history.can_undo());
}

// The importer's own reader gets the same positions, bit for bit, in the same order.
TEST(EditHistory, IsAnEditListOfTheImporter) {
  ImagingEdits edits;
  edits.seeds_mm = {{1.0 / 3.0, -20.1, 1e-3}, {-0.1, 1e4 / 7.0, 5.0}};
  const auto read = import::parse_edits(edit_list_text(edits), "edits.yaml");
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->size(), edits.seeds_mm.size());
  for (std::size_t i = 0; i < read->size(); ++i) {
    EXPECT_EQ((*read)[i].kind, import::EditKind::seed);
    EXPECT_EQ((*read)[i].bone, 0);
    EXPECT_EQ((*read)[i].points_mm, std::vector<Vec3>{edits.seeds_mm[i]});
  }
}

}  // namespace
}  // namespace osteon
