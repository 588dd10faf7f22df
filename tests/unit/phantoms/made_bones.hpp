// Phantom bones of tests, and their landmarks.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>

#include "common/phantoms/bone_parameters.hpp"
#include "common/phantoms/phantom_bone.hpp"
#include "tests/support/scenes/random.hpp"
#include "tests/support/trials.hpp"

namespace osteon::phantoms {

// The bone of a recipe that fits. It throws what make_bone() says of another one.
inline std::unique_ptr<PhantomBone> bone_of(const BoneRecipe& recipe) {
  auto made = make_bone(recipe);
  if (!made) throw std::runtime_error(made.error().message);
  return std::move(*made);
}

inline Vec3 landmark(const PhantomBone& bone, const std::string& name) {
  for (const Landmark& found : bone.anatomy().landmarks)
    if (found.name == name) return found.point_mm;
  ADD_FAILURE() << "no landmark " << name;
  return Vec3::Zero();
}

// Expects that such a bone is refused by one sentence that contains the parameter's own name and `also`.
inline void expect_refused(const std::string& kind, const std::string& name, double value, const std::string& also) {
  const auto made = make_bone({.kind = kind, .changes = {{name, value}}});
  ASSERT_FALSE(made) << name << " " << value;
  EXPECT_EQ(made.error().code, ErrorCode::invalid_input);
  const std::string& text = made.error().message;
  EXPECT_NE(text.find(name.substr(name.find('.') + 1)), std::string::npos) << text;
  EXPECT_NE(text.find(also), std::string::npos) << text;
  EXPECT_EQ(text.find('\n'), std::string::npos) << text;
}

// Expects it of each parameter of a table, beyond both ends of its range.
template <class Parameters>
void expect_ranges(const std::string& kind, std::span<const ParameterField<Parameters>> fields) {
  for (const ParameterField<Parameters>& field : fields)
    for (const double value : {field.least - 0.01 * std::max(1.0, std::abs(field.least)),
                               field.most + 0.01 * std::max(1.0, field.most), std::nan("")})
      expect_refused(kind, std::string(field.name), value, "give a value from");
}

// How many random sets of parameters a test of a kind of bone makes.
inline int random_sets() { return static_cast<int>(test::trials(200, 8)); }

// A bone of random words and parameters; those that do not fit together are drawn again. Each is up to `spread` away
// from the preset. Cartilage keeps the thickness that follows from the others.
inline std::unique_ptr<PhantomBone> random_bone(const std::string& kind, double spread, test::Random& random) {
  for (int tries = 0; tries < 2000; ++tries) {
    BoneRecipe recipe{.kind = kind, .side = random.index(2) == 0 ? Side::left : Side::right};
    recipe.preset = kPresets[random.index(std::size(kPresets))];
    recipe.condition = kConditions[random.index(std::size(kConditions))];
    for (const NamedValue& value : bone_of(recipe)->parameters()) {
      if (value.name.ends_with("cartilage_mm")) continue;
      const double most = spread * std::max(std::abs(value.value), 0.2 * value.most);
      recipe.changes[value.name] = std::clamp(value.value + random.between(-most, most), value.least, value.most);
    }
    if (auto made = make_bone(recipe)) return std::move(*made);
  }
  ADD_FAILURE() << "no " << kind << " in 2000 tries";
  return nullptr;
}

}  // namespace osteon::phantoms
