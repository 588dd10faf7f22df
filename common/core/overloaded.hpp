// One function object out of several, for std::visit: each alternative of a variant calls the one that fits it.
#pragma once

namespace osteon {

template <class... F>
struct Overloaded : F... {
  using F::operator()...;
};
// Clang before 17 does not deduce it otherwise.
template <class... F>
Overloaded(F...) -> Overloaded<F...>;

}  // namespace osteon
