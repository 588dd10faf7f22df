// Types for physical quantities, so that a depth is never passed where a force is meant. Inner loops use plain doubles
// whose names end in the unit.
#pragma once
#include <compare>

namespace osteon {

template <class Tag>
class Quantity {
 public:
  constexpr Quantity() = default;
  constexpr explicit Quantity(double value) noexcept : value_(value) {}
  [[nodiscard]] constexpr double value() const noexcept { return value_; }
  friend constexpr auto operator<=>(Quantity, Quantity) = default;
  friend constexpr Quantity operator+(Quantity a, Quantity b) noexcept { return Quantity{a.value_ + b.value_}; }
  friend constexpr Quantity operator-(Quantity a, Quantity b) noexcept { return Quantity{a.value_ - b.value_}; }
  friend constexpr Quantity operator*(double k, Quantity q) noexcept { return Quantity{k * q.value_}; }

 private:
  double value_ = 0.0;
};

using Millimetres = Quantity<struct MillimetreTag>;
using MillimetresPerSecond = Quantity<struct MillimetrePerSecondTag>;
using Seconds = Quantity<struct SecondTag>;
using Newtons = Quantity<struct NewtonTag>;
using NewtonMillimetres = Quantity<struct NewtonMillimetreTag>;
using NewtonsPerMillimetre = Quantity<struct NewtonPerMillimetreTag>;
using GramsPerCm3 = Quantity<struct GramPerCm3Tag>;
using RevolutionsPerMinute = Quantity<struct RpmTag>;

}  // namespace osteon
