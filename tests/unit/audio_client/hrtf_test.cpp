// Heads from formulas come back from the table, and the head that libmysofa comes with is one.
#include "audio_client/space/hrtf.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "audio_client/space/listener.hpp"
#include "audio_client/space/sofa_file.hpp"
#include "common/runtime/files.hpp"
#include "tests/support/content.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/audio_client/ideal_head.hpp"

namespace osteon::audio {
namespace {

using test::kPi;
using test::sphere;
using test::woodworth_delay_s;

double deaf_to_sides(double) { return 1.0; }
double shadowed(double along) { return 0.55 + 0.45 * along; }  // 1 at the near ear, 0.1 at the far one

Vec3 direction(double azimuth_degrees, double elevation_degrees) {
  const double a = azimuth_degrees * kPi / 180, e = elevation_degrees * kPi / 180;
  return {std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e)};
}

EarPair ears(const Hrtf& hrtf, const Vec3& towards) {
  EarPair heard;
  hrtf.towards(towards, heard);
  return heard;
}

// Magnitude of a filter at a frequency.
double gain(const EarFilter& filter, double hz) {
  std::complex<double> sum = 0;
  for (std::size_t n = 0; n < filter.size(); ++n)
    sum += static_cast<double>(filter[n]) * std::polar(1.0, -2 * kPi * hz * static_cast<double>(n) / 48000);
  return std::abs(sum);
}

double largest_difference(const EarFilter& a, const EarFilter& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, static_cast<double>(std::abs(a[i] - b[i])));
  return largest;
}

TEST(Hrtf, MeasuredDirectionsComeBack) {
  const auto hrtf = Hrtf::make(sphere(shadowed), 48000);
  ASSERT_TRUE(hrtf) << hrtf.error().message;
  for (const double azimuth : {0.0, 30.0, 90.0, 150.0, 180.0, 270.0, 340.0}) {
    for (const double elevation : {-60.0, 0.0, 40.0}) {
      const Vec3 towards = direction(azimuth, elevation);
      const EarPair heard = ears(*hrtf, towards);
      // A fiftieth of a sample: the parabola through three samples of the correlation.
      EXPECT_NEAR(heard.left.delay_s, woodworth_delay_s(towards.y()), 0.02 / 48000) << azimuth << " " << elevation;
      EXPECT_NEAR(heard.right.delay_s, woodworth_delay_s(-towards.y()), 0.02 / 48000) << azimuth << " " << elevation;
      // The level ahead is 0.55 in both ears, and becomes 1.
      for (const double hz : {200.0, 1000.0, 5000.0, 12000.0}) {
        EXPECT_NEAR(gain(heard.left.filter, hz) * 0.55 / shadowed(towards.y()), 1.0, 0.01) << azimuth << " " << hz;
        EXPECT_NEAR(gain(heard.right.filter, hz) * 0.55 / shadowed(-towards.y()), 1.0, 0.01) << azimuth << " " << hz;
      }
    }
  }
}

TEST(Hrtf, BetweenMeasuredDirectionsTheDelayIsRightWithinWhatEarsTell) {
  const auto hrtf = Hrtf::make(sphere(deaf_to_sides), 48000);
  ASSERT_TRUE(hrtf);
  // A line between points 10 degrees apart misses the sine by a / c (10 degrees)^2 / 8 = 1 us, and the kink of
  // Woodworth's path at the side by as much. Listeners tell 10 us apart.
  for (int i = 0; i < 97; ++i) {
    const double azimuth = 3.7 * i;
    const Vec3 towards = direction(azimuth, 0);
    const EarPair heard = ears(*hrtf, towards);
    const double wanted_s = woodworth_delay_s(-towards.y()) - woodworth_delay_s(towards.y());
    EXPECT_NEAR(heard.right.delay_s - heard.left.delay_s, wanted_s, 10e-6) << azimuth;
  }
}

TEST(Hrtf, IsContinuousAllRoundAndOverThePoles) {
  const auto hrtf = Hrtf::make(sphere(shadowed), 48000);
  ASSERT_TRUE(hrtf);
  constexpr double kStep = 0.1;  // degrees
  const auto apart = [&](const Vec3& one, const Vec3& other) {
    const EarPair a = ears(*hrtf, one), b = ears(*hrtf, other);
    return std::max(largest_difference(a.left.filter, b.left.filter),
                    largest_difference(a.right.filter, b.right.filter));
  };
  // The level changes by at most 0.45 / 0.55 in a radian. An interpolated one is steeper by less than a half.
  const double most = 1.5 * 0.45 / 0.55 * kStep * kPi / 180;
  for (int i = -1800; i < 1800; ++i)
    ASSERT_LT(apart(direction(kStep * i, 20), direction(kStep * (i + 1), 20)), most) << kStep * i;
  for (int i = -900; i < 900; ++i)
    ASSERT_LT(apart(direction(77, kStep * i), direction(77, kStep * (i + 1))), most) << kStep * i;
}

// A symmetric head hears a mirrored source with its ears exchanged.
void expect_symmetric(const Hrtf& hrtf) {
  for (int i = 0; i < 25; ++i) {
    const double azimuth = 7.3 * i;
    for (const double elevation : {-80.0, -35.0, -3.0, 0.0, 22.0, 64.0, 90.0}) {
      const EarPair here = ears(hrtf, direction(azimuth, elevation)),
                    there = ears(hrtf, direction(-azimuth, elevation));
      EXPECT_NEAR(here.left.delay_s, there.right.delay_s, 1e-7) << azimuth << " " << elevation;
      EXPECT_NEAR(here.right.delay_s, there.left.delay_s, 1e-7) << azimuth << " " << elevation;
      EXPECT_LT(largest_difference(here.left.filter, there.right.filter), 1e-4) << azimuth << " " << elevation;
      EXPECT_LT(largest_difference(here.right.filter, there.left.filter), 1e-4) << azimuth << " " << elevation;
    }
  }
}

TEST(Hrtf, ASymmetricHeadStaysSymmetric) {
  const auto hrtf = Hrtf::make(sphere(shadowed), 48000);
  ASSERT_TRUE(hrtf);
  expect_symmetric(*hrtf);
}

TEST(Hrtf, WrongMeasurementsAreRefused) {
  const auto refuse = [](auto change) {
    std::vector<HeadResponse> measured = sphere(deaf_to_sides);
    change(measured);
    const auto made = Hrtf::make(measured, 48000);
    ASSERT_FALSE(made);
    EXPECT_EQ(made.error().code, ErrorCode::invalid_input);
  };
  refuse([](auto& m) { m.resize(3); });
  refuse([](auto& m) { m[5].towards = Vec3::Zero(); });
  refuse([](auto& m) { m[5].towards.x() = std::numeric_limits<double>::infinity(); });
  refuse([](auto& m) { m[5].left.clear(); });
  refuse([](auto& m) { m[5].right.resize(Hrtf::kMostTaps + 1); });
  refuse([](auto& m) { m[5].left[3] = std::numeric_limits<float>::quiet_NaN(); });
  refuse([](auto& m) {
    for (HeadResponse& one : m) {
      std::fill(one.left.begin(), one.left.end(), 0.0F);
      std::fill(one.right.begin(), one.right.end(), 0.0F);
    }
  });
}

// KEMAR's head is no sphere. Long waves reach its far ear up to 3 a / c = 765 us later (Kuhn 1977), short ones after
// Woodworth's a / c (pi / 2 + 1) = 656 us. Its half breadth of 76 mm and half length of 96 mm allow a radius of 87.5 mm
// within 10 %. Either way 10 % of Woodworth, 66 us, is what a right table may deviate, and three samples of 48 kHz.
TEST(SofaFile, TheDefaultHeadHearsTheSideAsWoodworthSays) {
  for (const double rate_hz : {44100.0, 48000.0}) {
    const auto hrtf = read_hrtf({}, rate_hz);
    ASSERT_TRUE(hrtf) << hrtf.error().message;
    const double wanted_s = test::kHeadRadius_mm / kSoundSpeed_mm_per_s * (kPi / 2 + 1);
    for (const double side : {90.0, -90.0}) {
      const EarPair heard = ears(*hrtf, direction(side, 0));
      EXPECT_NEAR(heard.right.delay_s - heard.left.delay_s, std::copysign(wanted_s, side), 0.1 * wanted_s);
      // The head shades the far ear: by many dB where waves are shorter than the head, and by few where they are
      // longer.
      const EarFilter& near = side > 0 ? heard.left.filter : heard.right.filter;
      const EarFilter& far = side > 0 ? heard.right.filter : heard.left.filter;
      double high_db = 0;
      for (int i = 0; i < 20; ++i) {
        const double hz = 3000 + 250 * i;
        high_db += 20 * std::log10(gain(near, hz) / gain(far, hz)) / 20;
      }
      const double low_db = 20 * std::log10(gain(near, 400) / gain(far, 400));
      EXPECT_GT(high_db, 8);
      EXPECT_LT(low_db, high_db - 3);
    }
    const EarPair ahead = ears(*hrtf, direction(0, 0));
    double power = 0;
    constexpr int kTones = 5600 / 7;
    for (int i = 0; i < kTones; ++i) {
      const double amplitude = gain(ahead.left.filter, (403.5 + 7 * i) * 48000 / rate_hz);
      power += amplitude * amplitude / kTones;
    }
    EXPECT_NEAR(power, 1.0, 0.02) << "where a drilling sounds, a tool ahead is as loud as without a head";
    EXPECT_NEAR(ahead.left.delay_s, 0, 1e-7);
  }
}

TEST(SofaFile, TheDefaultHeadIsSymmetric) {
  const auto hrtf = read_hrtf({}, 48000);
  ASSERT_TRUE(hrtf) << hrtf.error().message;
  expect_symmetric(*hrtf);
}

// Arrays that are shorter than the numbers beside them say. libmysofa reads such a file without a complaint.
TEST(SofaFile, NumbersThatAreNotThoseOfTheDataAreRefused) {
  const test::TempDir temp;
  const std::string whole = test::content("/usr/share/libmysofa/MIT_KEMAR_normal_pinna.sofa");
  ASSERT_FALSE(whole.empty());
  // A number 710 of 8 bytes is that of the directions, and a 512 that of the samples. Others of them change nothing
  // here.
  for (const auto& [number, other] : {std::pair<std::uint64_t, std::uint64_t>{710, 9999}, {512, 1000}}) {
    const std::string_view was(reinterpret_cast<const char*>(&number), sizeof number);
    bool refused = false;
    for (std::size_t at = whole.find(was); at != std::string::npos && !refused; at = whole.find(was, at + 1)) {
      std::string damaged = whole;
      std::memcpy(damaged.data() + at, &other, sizeof other);
      ASSERT_TRUE(write_file(temp / "damaged.sofa", damaged));
      const auto read = read_hrtf(temp / "damaged.sofa", 44100);  // its own rate: another takes twice as long
      refused = !read && read.error().message.find("are not those of its data") != std::string::npos &&
                read.error().message.find("damaged.sofa") != std::string::npos;
    }
    EXPECT_TRUE(refused) << number;
  }
}

TEST(SofaFile, WhatIsNoHeadIsOneSentence) {
  const test::TempDir temp;
  ASSERT_TRUE(write_file(temp / "text.sofa", "no sofa at all"));
  ASSERT_TRUE(write_file(temp / "empty.sofa", ""));
  // HDF5's signature, and nothing that follows from it.
  std::string cut("\x89HDF\r\n\x1a\n", 8);
  cut.resize(108);
  ASSERT_TRUE(write_file(temp / "cut.sofa", cut));
  for (const char* name : {"text.sofa", "empty.sofa", "cut.sofa", "missing.sofa", "."}) {
    const auto refused = read_hrtf(temp / name, 48000);
    ASSERT_FALSE(refused) << name;
    EXPECT_THAT(refused.error().message,
                testing::AllOf(testing::HasSubstr((temp / name).string()), testing::HasSubstr("--hrtf"),
                               testing::Not(testing::HasSubstr("\n"))));
  }
}

TEST(Listener, TheUsualOneStandsAtThePatientsRightAndLooksAtTheBone) {
  for (const Listening way : {Listening::loudspeakers, Listening::headphones}) {
    const Vec3 from_mm = usual_listener_mm(way);
    EXPECT_NEAR(from_mm.norm(), reference_mm(way), 1e-9);
    EXPECT_LT(from_mm.x(), 0) << "the patient's right";
    EXPECT_LT(from_mm.y(), 0) << "above a patient on the back";
    const Pose head = looking(from_mm, Vec3::Zero(), -Vec3::UnitY());
    EXPECT_TRUE(head.direction(Vec3::UnitX()).isApprox(-from_mm.normalized(), 1e-9)) << "looks at the bone";
    EXPECT_TRUE(head.direction(Vec3::UnitY()).isApprox(Vec3::UnitZ(), 1e-9)) << "the patient's head is at the left";
    EXPECT_LT(head.direction(Vec3::UnitZ()).y(), 0) << "upright";
  }
  EXPECT_DOUBLE_EQ(reference_mm(Listening::headphones), 500);
}

TEST(Listener, AnyHeadIsAPose) {
  const Vec3 somewhere(10, -20, 30);
  for (const Vec3& up : {Vec3(Vec3::UnitZ()), Vec3(Vec3::Zero()), somewhere, Vec3(-somewhere)}) {
    const Pose head = looking(somewhere, Vec3::Zero(), up);
    EXPECT_NEAR(head.rotation.norm(), 1, 1e-9);
    EXPECT_TRUE(head.direction(Vec3::UnitX()).isApprox(-somewhere.normalized(), 1e-9));
  }
  EXPECT_NEAR(looking(somewhere, somewhere, Vec3::UnitZ()).rotation.norm(), 1, 1e-9);
}

TEST(Listener, WaysHaveNames) {
  EXPECT_EQ(*listening("mono"), Listening::mono);
  EXPECT_EQ(*listening("loudspeakers"), Listening::loudspeakers);
  EXPECT_EQ(*listening("headphones"), Listening::headphones);
  const auto unknown = listening("tin can");
  ASSERT_FALSE(unknown);
  EXPECT_THAT(unknown.error().message, testing::AllOf(testing::HasSubstr("tin can"), testing::HasSubstr("headphones")));
}

}  // namespace
}  // namespace osteon::audio
