// The type of a number in memory, as HDF5 names it. HDF5's own header stays in .cpp files.
#pragma once
#include <cstdint>

namespace osteon {

template <class Number>
[[nodiscard]] std::int64_t hdf5_type();
template <>
std::int64_t hdf5_type<double>();
template <>
std::int64_t hdf5_type<float>();
template <>
std::int64_t hdf5_type<std::uint8_t>();
template <>
std::int64_t hdf5_type<std::uint32_t>();
template <>
std::int64_t hdf5_type<std::uint64_t>();
template <>
std::int64_t hdf5_type<std::int64_t>();

}  // namespace osteon
