// The loops that read a lattice of HU: samples along a line of a slice, and sums along rays. They are written once
// (sampling_rows.inl) for registers of 4 and 8 floats. At run time the widest that the processor has is chosen. Each
// width gives the same bytes.
#pragma once
#include <array>

#include "common/radiology/bone_hu.hpp"

namespace osteon::radiology {

// HU at start + i · step, in lattice coordinates, trilinear. Air outside the lattice.
void sample_line(const HuLattice& lattice, const std::array<float, 3>& start, const std::array<float, 3>& step,
                 int count, float* hu);

inline constexpr int kRays = 8;

// Neighbouring rays with one dominant axis: the one along which all of them are the longest. The planes of the lattice
// across it are numbered from 0. A ray meets plane k at (u + k du, v + k dv): x and y of the lattice without the
// dominant axis. It exists on the planes from `first` to `last`.
struct RayPacket {
  alignas(32) std::array<float, kRays> u, du, v, dv, first, last;
};

// Adds the steps of the planes from `first` to `last` at the rays, bilinear in each plane (Joseph 1982).
void add_planes(const HuLattice& lattice, int axis, int first, int last, const RayPacket& rays,
                std::array<float, kRays>& sums);

// The same, but keeps the largest of what is given and of the steps on these planes: for maximum intensity. Steps are
// never below zero.
void most_of_planes(const HuLattice& lattice, int axis, int first, int last, const RayPacket& rays,
                    std::array<float, kRays>& most);

// For tests: limits the number of samples computed at once (4 or 8). Returns the width in use.
int limit_sampling_lanes(int lanes);

}  // namespace osteon::radiology
