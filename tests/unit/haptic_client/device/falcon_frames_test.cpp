// The Falcon's wire format, byte by byte.
#include "haptic_client/device/falcon_frames.hpp"

#include <gtest/gtest.h>

#include <random>
#include <string_view>

namespace osteon::haptic {
namespace {

FalconFrame frame(std::string_view text) {
  FalconFrame out{};
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = static_cast<std::uint8_t>(text[i]);
  return out;
}

std::vector<std::uint8_t> bytes(std::string_view text) { return {text.begin(), text.end()}; }

TEST(FalconFrames, NibblesAreShiftedLettersLowestFirst) {
  // 0x1234 → 4 3 2 1 → E D C B; −1 → P P P P; −4096 = 0xf000 → A A A P.
  EXPECT_EQ(encode(FalconCommand{{0x1234, -1, -4096}, false, 0}), frame("<EDCBPPPPAAAPAA>"));
  EXPECT_EQ(encode(FalconCommand{{}, true, kFalconRed}), frame("<AAAAAAAAAAAAJA>"));
  EXPECT_EQ(encode(FalconCommand{{}, false, kFalconGreen | kFalconBlue}), frame("<AAAAAAAAAAAAGA>"));
}

TEST(FalconFrames, EncodersButtonsAndHoming) {
  const auto state =
      decode_state(frame("<AMOPCAAAPPPP"
                         "\x85"
                         "A>"));  // 0x41 + 4 (centre) + 0x40 (third axis homed)
  ASSERT_TRUE(state);
  EXPECT_EQ(state->encoders, (FalconCounts{static_cast<std::int16_t>(0xfec0), 2, -1}));
  EXPECT_EQ(state->buttons, kFalconCentre);
  EXPECT_EQ(state->homed, 4);
}

TEST(FalconFrames, ThereAndBack) {
  std::mt19937 random(3);
  for (int i = 0; i < 10000; ++i) {
    const auto number = [&] { return static_cast<std::int16_t>(random()); };
    const FalconState state{{number(), number(), number()},
                            static_cast<std::uint8_t>(random() & 15),
                            static_cast<std::uint8_t>(random() & 7)};
    const auto back = decode_state(encode(state));
    ASSERT_TRUE(back);
    EXPECT_EQ(back->encoders, state.encoders);
    EXPECT_EQ(back->buttons, state.buttons);
    EXPECT_EQ(back->homed, state.homed);
    const FalconCommand command{
        {number(), number(), number()}, (random() & 1) != 0, static_cast<std::uint8_t>(random() & 14)};
    const auto told = decode_command(encode(command));
    ASSERT_TRUE(told);
    EXPECT_EQ(told->motors, command.motors);
    EXPECT_EQ(told->homing, command.homing);
    EXPECT_EQ(told->lights, command.lights);
  }
}

TEST(FalconFrames, NoFrameWithAnyLetterOutOfRange) {
  const FalconFrame good = frame("<EDCBPPPPAAAPAA>");
  for (std::size_t i = 0; i < 13; ++i) {
    for (const std::uint8_t wrong : {std::uint8_t{'?'}, std::uint8_t{0}, std::uint8_t{'Q'}, std::uint8_t{255}}) {
      FalconFrame bad = good;
      bad[i] = wrong;
      EXPECT_FALSE(decode_state(bad)) << i << ' ' << int{wrong};
    }
  }
}

TEST(FalconFrames, TheReaderJoinsPiecesAndFindsItsPlaceAgain) {
  FalconFrameReader reader;
  EXPECT_FALSE(reader.take(bytes("AAA>AA")));  // end of an earlier frame
  EXPECT_FALSE(reader.take(bytes("<BAAAAAA")));
  const auto joined = reader.take(bytes("AAAAAAA>"));
  ASSERT_TRUE(joined);
  EXPECT_EQ(joined->encoders[0], 1);
  EXPECT_EQ(reader.broken(), 0u);

  // A lost byte ends one frame, but not the next. Of two whole frames the newest counts.
  const auto newest =
      reader.take(bytes("<AAAAAAAAAAAAA>"
                        "<CAAAAAAAAAAAAA>"
                        "<DAAAAAAAAAAAAA>"));
  ASSERT_TRUE(newest);
  EXPECT_EQ(newest->encoders[0], 3);
  EXPECT_EQ(reader.broken(), 1u);

  EXPECT_FALSE(reader.take(bytes("<AAAA<AAAA?AAAAAAAAA>")));
  EXPECT_EQ(reader.broken(), 3u);
  EXPECT_TRUE(reader.take(bytes("<AAAAAAAAAAAAAA>")));
}

// Only whole frames come out, whatever bytes arrive. Frames among noise without '<' are all found.
TEST(FalconFrames, FramesAmongNoise) {
  std::mt19937 random(5);
  FalconFrameReader reader;
  int sent = 0, found = 0;
  for (int i = 0; i < 2000; ++i) {
    std::vector<std::uint8_t> stream;
    for (unsigned n = random() % 8; n > 0; --n) stream.push_back(static_cast<std::uint8_t>('A' + random() % 60));
    const FalconState state{{static_cast<std::int16_t>(i), 0, 0}, 0, 0};
    const FalconFrame good = encode(state);
    stream.insert(stream.end(), good.begin(), good.end());
    ++sent;
    const auto heard = reader.take(stream);
    if (heard && heard->encoders[0] == i) ++found;
  }
  EXPECT_EQ(found, sent);
}

TEST(FalconFrames, ModemStatusIsNoData) {
  const std::vector<std::uint8_t> packet{1, 0x60, '<'};
  EXPECT_EQ(without_modem_status(packet).size(), 1u);
  EXPECT_TRUE(without_modem_status(std::span(packet).first(2)).empty());
  EXPECT_TRUE(without_modem_status(std::span(packet).first(1)).empty());
}

}  // namespace
}  // namespace osteon::haptic
