// A part of sampling.cpp, which includes it once for each register width: kLanes samples at a time. For every width,
// each lane does the same operations in the same order.

typedef float Row __attribute__((vector_size(kLanes * 4)));
typedef std::int32_t RowInt __attribute__((vector_size(kLanes * 4)));
typedef std::uint32_t RowBits __attribute__((vector_size(kLanes * 4)));

OSTEON_INLINE Row splat(float x) { return x - Row{}; }
OSTEON_INLINE Row load(const float* from) {
  Row x;
  std::memcpy(&x, from, sizeof x);
  return x;
}
OSTEON_INLINE void store(float* to, Row x) { std::memcpy(to, &x, sizeof x); }

#if OSTEON_LANES == 8
OSTEON_INLINE Row low(Row a, Row b) { return _mm256_min_ps(a, b); }
OSTEON_INLINE Row high(Row a, Row b) { return _mm256_max_ps(a, b); }
// Two neighbouring samples of each lane: the lower 16 bits are the sample at the place, the upper those of the next.
OSTEON_INLINE RowBits pairs(const std::uint16_t* base, RowInt place) {
  const __m256i found = _mm256_i32gather_epi32(reinterpret_cast<const int*>(base), reinterpret_cast<__m256i>(place), 2);
  return reinterpret_cast<RowBits>(found);
}
#else
OSTEON_INLINE Row low(Row a, Row b) { return a < b ? a : b; }
OSTEON_INLINE Row high(Row a, Row b) { return a > b ? a : b; }
OSTEON_INLINE RowBits pairs(const std::uint16_t* base, RowInt place) {
  RowBits found;
  for (int i = 0; i < kLanes; ++i) {
    std::uint32_t both;
    std::memcpy(&both, base + place[i], sizeof both);
    found[i] = both;
  }
  return found;
}
#endif

OSTEON_INLINE Row lower_of(RowBits both) {
  return __builtin_convertvector(reinterpret_cast<RowInt>(both & 0xffffu), Row);
}
OSTEON_INLINE Row upper_of(RowBits both) { return __builtin_convertvector(reinterpret_cast<RowInt>(both >> 16), Row); }

// The cell of a position along an axis with `samples` samples, and the weight of its upper end. Positions outside go to
// the outermost samples, which are air.
struct CellRow {
  RowInt cell;
  Row weight;
};
OSTEON_INLINE CellRow cell_of(Row at, std::int32_t samples) {
  const Row within = low(high(at, splat(0.0f)), splat(static_cast<float>(samples - 1)));
  const RowInt whole = __builtin_convertvector(within, RowInt);
  const Row cell = low(__builtin_convertvector(whole, Row), splat(static_cast<float>(samples - 2)));
  return {__builtin_convertvector(cell, RowInt), within - cell};
}

OSTEON_INLINE Row mixed(Row a, Row b, Row weight) { return a + weight * (b - a); }

// Bilinear in a plane: between the pairs of two rows.
OSTEON_INLINE Row in_pairs(const std::uint16_t* plane, RowInt place, std::int32_t next_row, Row across, Row along) {
  const RowBits a = pairs(plane, place), b = pairs(plane, place + next_row);
  return mixed(mixed(lower_of(a), upper_of(a), along), mixed(lower_of(b), upper_of(b), along), across);
}

// The same as hu_of_steps().
OSTEON_INLINE Row hu_rows(Row steps) {
  const Row water = low(steps, splat(kStepsOfWater)), bone = high(steps - kStepsOfWater, splat(0.0f));
  return (water * kHuPerStepBelowWater + kAir_hu) + bone * kHuPerStepAboveWater;
}

void line_rows(const HuLattice& lattice, const float* start, const float* step, int count, float* hu) {
  const std::int32_t nz = lattice.dims.z, plane = lattice.dims.y * nz;
  const std::int32_t dims[3] = {lattice.dims.x, lattice.dims.y, lattice.dims.z};
  for (int first = 0; first < count; first += kLanes) {
    Row number;
    for (int lane = 0; lane < kLanes; ++lane) number[lane] = static_cast<float>(first + lane);
    CellRow c[3];
    for (int axis = 0; axis < 3; ++axis) c[axis] = cell_of(start[axis] + number * step[axis], dims[axis]);
    const RowInt place = c[0].cell * plane + c[1].cell * nz + c[2].cell;
    const Row near_x = in_pairs(lattice.steps, place, nz, c[1].weight, c[2].weight);
    const Row far_x = in_pairs(lattice.steps, place + plane, nz, c[1].weight, c[2].weight);
    const Row value = hu_rows(mixed(near_x, far_x, c[0].weight));
    if (first + kLanes <= count) {
      store(hu + first, value);
    } else {
      for (int lane = 0; first + lane < count; ++lane) hu[first + lane] = value[lane];
    }
  }
}

// Strides of the dominant axis and of u and v, in samples. v is along pairs unless the dominant axis is z.
struct PlaneStrides {
  std::ptrdiff_t plane;
  std::int32_t u, v, size_u, size_v;
};

// kMost: the largest value of the planes, and not their sum.
template <bool kPairs, bool kMost>
void ray_rows(const HuLattice& lattice, const PlaneStrides& s, int first, int last, const RayPacket& rays, int lane,
              float* sums) {
  const auto lanes = static_cast<std::size_t>(lane);
  const Row u = load(rays.u.data() + lanes), du = load(rays.du.data() + lanes), v = load(rays.v.data() + lanes),
            dv = load(rays.dv.data() + lanes), begin = load(rays.first.data() + lanes),
            end = load(rays.last.data() + lanes);
  const Row none = splat(0.0f);
  Row sum = load(sums + lane);
  for (int k = first; k <= last; ++k) {
    const Row at = splat(static_cast<float>(k));
    const CellRow cu = cell_of(u + at * du, s.size_u), cv = cell_of(v + at * dv, s.size_v);
    const std::uint16_t* plane = lattice.steps + k * s.plane;
    Row value;
    if constexpr (kPairs) {
      value = in_pairs(plane, cu.cell * s.u + cv.cell, s.u, cu.weight, cv.weight);
    } else {
      const RowInt place = cu.cell * s.u + cv.cell * s.v;
      const Row a = lower_of(pairs(plane, place)), b = lower_of(pairs(plane, place + s.v)),
                c = lower_of(pairs(plane, place + s.u)), d = lower_of(pairs(plane, place + (s.u + s.v)));
      value = mixed(mixed(a, b, cv.weight), mixed(c, d, cv.weight), cu.weight);
    }
    const Row met = ((at >= begin) & (at <= end)) ? value : none;
    sum = kMost ? high(sum, met) : sum + met;
  }
  store(sums + lane, sum);
}

template <bool kMost>
void plane_rows(const HuLattice& lattice, int axis, int first, int last, const RayPacket& rays, float* sums) {
  const std::int32_t nz = lattice.dims.z, plane = lattice.dims.y * nz;
  for (int lane = 0; lane < kRays; lane += kLanes) {
    if (axis == 0)
      ray_rows<true, kMost>(lattice, {plane, nz, 1, lattice.dims.y, nz}, first, last, rays, lane, sums);
    else if (axis == 1)
      ray_rows<true, kMost>(lattice, {nz, plane, 1, lattice.dims.x, nz}, first, last, rays, lane, sums);
    else
      ray_rows<false, kMost>(lattice, {1, plane, nz, lattice.dims.x, lattice.dims.y}, first, last, rays, lane, sums);
  }
}
