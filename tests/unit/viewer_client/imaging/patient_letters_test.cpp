#include "viewer_client/imaging/patient_letters.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace osteon {
namespace {

TEST(PatientLetters, NameTheSidesOfThePatient) {
  EXPECT_EQ(patient_letters({2, 0, 0}), "L");
  EXPECT_EQ(patient_letters({-1, 0, 0}), "R");
  EXPECT_EQ(patient_letters({0, 1, 0}), "P");
  EXPECT_EQ(patient_letters({0, -1, 0}), "A");
  EXPECT_EQ(patient_letters({0, 0, 1}), "H");
  EXPECT_EQ(patient_letters({0, 0, -1}), "F");
}

TEST(PatientLetters, NameASecondSideFromAQuarterOfARightAngle) {
  const auto tilted = [](double degrees) {
    const double rad = degrees / 180.0 * std::numbers::pi;
    return patient_letters({std::cos(rad), -std::sin(rad), 0.0});
  };
  EXPECT_EQ(tilted(22.0), "L");
  EXPECT_EQ(tilted(23.0), "LA");
  EXPECT_EQ(tilted(67.0), "AL");
  EXPECT_EQ(tilted(68.0), "A");
}

}  // namespace
}  // namespace osteon
