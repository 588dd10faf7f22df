#include "common/recording/hdf5_type.hpp"

#include <hdf5.h>

#include <type_traits>

namespace osteon {

static_assert(std::is_same_v<hid_t, std::int64_t>);

template <>
std::int64_t hdf5_type<double>() {
  return H5T_NATIVE_DOUBLE;
}
template <>
std::int64_t hdf5_type<float>() {
  return H5T_NATIVE_FLOAT;
}
template <>
std::int64_t hdf5_type<std::uint8_t>() {
  return H5T_NATIVE_UINT8;
}
template <>
std::int64_t hdf5_type<std::uint32_t>() {
  return H5T_NATIVE_UINT32;
}
template <>
std::int64_t hdf5_type<std::uint64_t>() {
  return H5T_NATIVE_UINT64;
}
template <>
std::int64_t hdf5_type<std::int64_t>() {
  return H5T_NATIVE_INT64;
}

}  // namespace osteon
