#include "viewer_client/imaging/edit_history.hpp"

#include <gtest/gtest.h>

#include <memory>

namespace osteon {
namespace {

ImagingEdits with_seed(ImagingEdits edits, const Vec3& seed) {
  edits.seeds.push_back({seed, 1});
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

TEST(EditHistory, EveryKindOfEditIsAStep) {
  EditHistory history;
  std::vector<ImagingEdits> states{history.now()};
  const auto step = [&](auto change) {
    ImagingEdits edits = history.now();
    change(edits);
    history.apply(edits);
    states.push_back(edits);
  };
  step([](ImagingEdits& edits) { edits.filter.median = MedianFilter::volume; });
  step([](ImagingEdits& edits) { edits.filter.gaussian_mm = 0.5; });
  step([](ImagingEdits& edits) { edits.box = MarkedBox{{0, 0, 0}, {5, 5, 5}}; });
  step([](ImagingEdits& edits) { edits.seeds.push_back({{1, 1, 1}, 0}); });
  step([](ImagingEdits& edits) {
    edits.corrections.push_back(std::make_shared<const Correction>(Correction{.bone = 1, .points_mm = {{1, 2, 3}}}));
  });
  step([](ImagingEdits& edits) { own_label(edits, 1).name = "femur"; });
  step([](ImagingEdits& edits) { own_label(edits, 1).opacity_percent = 50; });
  for (std::size_t i = states.size(); i-- > 0;) {
    EXPECT_EQ(history.now(), states[i]) << i;
    history.undo();
  }
  for (std::size_t i = 1; i < states.size(); ++i) {
    history.redo();
    EXPECT_EQ(history.now(), states[i]) << i;
  }
}

TEST(EditHistory, AnEditThatChangesNothingIsNoStep) {
  EditHistory history;
  history.apply(history.now());
  EXPECT_FALSE(history.can_undo());
}

}  // namespace
}  // namespace osteon
