// Ranges that errors name: they lie within the limits of the parameter's table, and what they give is taken.
#include "common/phantoms/bone_parameters.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <set>
#include <string>

namespace osteon::phantoms {
namespace {

struct Thing {
  double length_mm = 10.0, width_mm = 4.0;
};
constexpr ParameterField<Thing> kThingFields[] = {{"length_mm", &Thing::length_mm, 5.0, 20.0},
                                                  {"width_mm", &Thing::width_mm, 2.0, 8.0}};

std::string refusal(const Thing& thing, double least, double most) {
  const DependentLimit limits[] = {{"width_mm", least, most, "length_mm"}};
  const auto checked = check_parameters<Thing>(thing, kThingFields, limits);
  return checked ? "" : checked.error().message;
}

TEST(BoneParameters, DependentLimitsNarrowThoseOfTheTable) {
  EXPECT_EQ(refusal({}, 1.0, 5.0), "");
  EXPECT_EQ(refusal({}, 1.0, 3.0), "width_mm is 4, which does not fit length_mm; give a value from 2 to 3");
  EXPECT_EQ(refusal({}, 5.0, 9.0), "width_mm is 4, which does not fit length_mm; give a value from 5 to 8");
  // Rounded to what is allowed.
  EXPECT_EQ(refusal({}, 5.0012, 6.0088), "width_mm is 4, which does not fit length_mm; give a value from 5.01 to 6");
  EXPECT_EQ(refusal({}, 9.0, 12.0), "width_mm is 4, which does not fit length_mm; change length_mm");
  EXPECT_EQ(refusal({.length_mm = 4.0}, 1.0, 3.0), "length_mm is 4; give a value from 5 to 20");
}

// "NAME is VALUE, which does not fit ...; give a value from LEAST to MOST"
struct Range {
  std::string name;
  double least = 0.0, most = 0.0;
};
Range range_in(const std::string& message) {
  Range found;
  found.name = message.substr(0, message.find(' '));
  if (const std::size_t from = message.find("from "); from != std::string::npos)
    EXPECT_EQ(std::sscanf(message.c_str() + from, "from %lf to %lf", &found.least, &found.most), 2) << message;
  return found;
}

void expect_ranges_that_are_taken(const std::string& kind, const std::string& preset) {
  const auto whole = make_bone({.kind = kind, .preset = preset});
  ASSERT_TRUE(whole) << whole.error().message;
  const std::vector<NamedValue> values = (*whole)->parameters();
  std::set<std::string> seen;
  for (const NamedValue& value : values)
    for (int part = 0; part <= 20; ++part) {
      BoneRecipe recipe{.kind = kind, .preset = preset};
      recipe.changes[value.name] = value.least + 0.05 * part * (value.most - value.least);
      const auto made = make_bone(recipe);
      if (made) continue;
      const std::string& message = made.error().message;
      const Range range = range_in(message);
      const auto named = std::ranges::find(values, range.name, &NamedValue::name);
      ASSERT_NE(named, values.end()) << message;
      if (range.least == 0.0 && range.most == 0.0) continue;  // no value fits
      EXPECT_GE(range.least, named->least) << message;
      EXPECT_LE(range.most, named->most) << message;
      for (const double given : {range.least, range.most}) {
        recipe.changes[range.name] = given;
        if (const auto again = make_bone(recipe); !again) {
          // The next sentence is of another parameter.
          EXPECT_NE(range_in(again.error().message).name, range.name) << message << ", then " << again.error().message;
        }
      }
    }
}

TEST(BoneParameters, RangesInErrorsLieWithinTheTableAndAreTaken) {
  for (const char* kind : {"femur", "tibia", "patella", "pelvis"})
    for (const std::string_view preset : kPresets)
      ASSERT_NO_FATAL_FAILURE(expect_ranges_that_are_taken(kind, std::string(preset)));
}

}  // namespace
}  // namespace osteon::phantoms
