#include "common/radiology/sampling.hpp"

#include <atomic>
#include <cstddef>
#include <cstring>

#if defined(__x86_64__)
#include <immintrin.h>
#define OSTEON_WIDE_ROWS 1
#endif

#define OSTEON_INLINE static inline __attribute__((always_inline))

namespace osteon::radiology {
namespace {

namespace narrow {
constexpr int kLanes = 4;
#define OSTEON_LANES 4
#include "common/radiology/sampling_rows.inl"
#undef OSTEON_LANES
}  // namespace narrow

#ifdef OSTEON_WIDE_ROWS
#if defined(__clang__)
#pragma clang attribute push(__attribute__((target("avx2"))), apply_to = function)
#else
#pragma GCC push_options
#pragma GCC target("avx2")
#endif
namespace wide {
constexpr int kLanes = 8;
#define OSTEON_LANES 8
#include "common/radiology/sampling_rows.inl"
#undef OSTEON_LANES
}  // namespace wide
#if defined(__clang__)
#pragma clang attribute pop
#else
#pragma GCC pop_options
#endif
#endif

struct SamplingRows {
  int lanes;
  decltype(&narrow::line_rows) line;
  decltype(&narrow::plane_rows<false>) planes, most;
};

constexpr SamplingRows kNarrowRows{narrow::kLanes, narrow::line_rows, narrow::plane_rows<false>,
                                   narrow::plane_rows<true>};
#ifdef OSTEON_WIDE_ROWS
constexpr SamplingRows kWideRows{wide::kLanes, wide::line_rows, wide::plane_rows<false>, wide::plane_rows<true>};
#endif

const SamplingRows* widest_sampling([[maybe_unused]] int lanes) {
#ifdef OSTEON_WIDE_ROWS
  if (lanes >= 8 && __builtin_cpu_supports("avx2")) return &kWideRows;
#endif
  return &kNarrowRows;
}

std::atomic<const SamplingRows*>& chosen_sampling() {
  static std::atomic<const SamplingRows*> chosen{widest_sampling(8)};
  return chosen;
}

}  // namespace

void sample_line(const HuLattice& lattice, const std::array<float, 3>& start, const std::array<float, 3>& step,
                 int count, float* hu) {
  chosen_sampling().load(std::memory_order_relaxed)->line(lattice, start.data(), step.data(), count, hu);
}

void add_planes(const HuLattice& lattice, int axis, int first, int last, const RayPacket& rays,
                std::array<float, kRays>& sums) {
  chosen_sampling().load(std::memory_order_relaxed)->planes(lattice, axis, first, last, rays, sums.data());
}

void most_of_planes(const HuLattice& lattice, int axis, int first, int last, const RayPacket& rays,
                    std::array<float, kRays>& most) {
  chosen_sampling().load(std::memory_order_relaxed)->most(lattice, axis, first, last, rays, most.data());
}

int limit_sampling_lanes(int lanes) {
  const SamplingRows* rows = widest_sampling(lanes);
  chosen_sampling().store(rows, std::memory_order_relaxed);
  return rows->lanes;
}

}  // namespace osteon::radiology
