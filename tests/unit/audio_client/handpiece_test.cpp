// The partials of each hand piece, and how its body radiates them.
#include <gtest/gtest.h>

#include "audio_client/synth/handpiece.hpp"

namespace osteon::audio {
namespace {

TEST(Handpiece, PartialsAreFewEnoughAndPositive) {
  for (const HandpieceKind kind : {HandpieceKind::geared_drill, HandpieceKind::direct_burr}) {
    const Handpiece piece = make_handpiece(kind);
    EXPECT_LE(piece.partials.size(), static_cast<std::size_t>(kMaxPartials));
    for (const Partial& partial : piece.partials) {
      EXPECT_GT(partial.ratio, 0);
      EXPECT_GT(partial.level, 0);
    }
  }
}

TEST(Handpiece, RadiatesBestInTheMiddleBand) {
  EXPECT_LT(radiation(20), 0.02);
  for (const double hz : {600.0, 1000.0, 3000.0, 5500.0}) EXPECT_GT(radiation(hz), 0.6) << hz;
  EXPECT_LT(radiation(15000), 0.25);
}

}  // namespace
}  // namespace osteon::audio
