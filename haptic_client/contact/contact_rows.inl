// Part of contact.cpp, which includes it once for each width of the processor's registers. It processes kLanes points
// at a time. Each lane does the same operations in the same order for every width.

typedef float Row __attribute__((vector_size(kLanes * 4)));
typedef std::int32_t RowInt __attribute__((vector_size(kLanes * 4)));
typedef double Pairs __attribute__((vector_size(kLanes * 4)));  // each holds two neighbouring samples

OSTEON_INLINE Row splat(float x) { return x - Row{}; }
OSTEON_INLINE RowInt splat_int(std::int32_t x) { return x - RowInt{}; }
OSTEON_INLINE RowInt trunc_to_int(Row x) { return __builtin_convertvector(x, RowInt); }
OSTEON_INLINE Row to_float(RowInt x) { return __builtin_convertvector(x, Row); }
OSTEON_INLINE Row low(Row a, Row b) { return b < a ? b : a; }
OSTEON_INLINE Row load(const float* from) {
  Row x;
  std::memcpy(&x, from, sizeof x);
  return x;
}
OSTEON_INLINE void store(float* to, Row x) { std::memcpy(to, &x, sizeof x); }

OSTEON_INLINE double pair_at(const float* from) {
  double two;
  std::memcpy(&two, from, sizeof two);
  return two;
}

// Loads the samples at an offset from each lane's corner, and the samples above them: two at a time, then separated.
OSTEON_INLINE void two_rows(const float* const* at, int offset, Row& first, Row& second) {
#define OSTEON_P(i) pair_at(at[i] + offset)
#if OSTEON_LANES == 4
  const Pairs a = {OSTEON_P(0), OSTEON_P(1)}, b = {OSTEON_P(2), OSTEON_P(3)};
#define OSTEON_EVEN 0, 2, 4, 6
#define OSTEON_ODD 1, 3, 5, 7
#elif OSTEON_LANES == 8
  const Pairs a = {OSTEON_P(0), OSTEON_P(1), OSTEON_P(4), OSTEON_P(5)},
              b = {OSTEON_P(2), OSTEON_P(3), OSTEON_P(6), OSTEON_P(7)};
#define OSTEON_EVEN 0, 2, 8, 10, 4, 6, 12, 14
#define OSTEON_ODD 1, 3, 9, 11, 5, 7, 13, 15
#else
  const Pairs a = {OSTEON_P(0), OSTEON_P(1), OSTEON_P(4),  OSTEON_P(5),
                   OSTEON_P(8), OSTEON_P(9), OSTEON_P(12), OSTEON_P(13)};
  const Pairs b = {OSTEON_P(2),  OSTEON_P(3),  OSTEON_P(6),  OSTEON_P(7),
                   OSTEON_P(10), OSTEON_P(11), OSTEON_P(14), OSTEON_P(15)};
#define OSTEON_EVEN 0, 2, 16, 18, 4, 6, 20, 22, 8, 10, 24, 26, 12, 14, 28, 30
#define OSTEON_ODD 1, 3, 17, 19, 5, 7, 21, 23, 9, 11, 25, 27, 13, 15, 29, 31
#endif
  const Row x = reinterpret_cast<Row>(a), y = reinterpret_cast<Row>(b);
  first = __builtin_shufflevector(x, y, OSTEON_EVEN);
  second = __builtin_shufflevector(x, y, OSTEON_ODD);
#undef OSTEON_EVEN
#undef OSTEON_ODD
#undef OSTEON_P
}

struct Cell {
  RowInt brick;    // index in the grid's table
  RowInt inside;   // all bits set where the table contains it
  RowInt corner;   // sample of the brick
  Row tx, ty, tz;  // 0 to 1 in the cell
};

OSTEON_INLINE Cell cell_of(const GridPlace& grid, Row px, Row py, Row pz) {
  const float inverse = grid.inverse_pitch;
  const Row x = px * inverse + splat(grid.shift[0]), y = py * inverse + splat(grid.shift[1]),
            z = pz * inverse + splat(grid.shift[2]);
  const RowInt cx = trunc_to_int(x), cy = trunc_to_int(y), cz = trunc_to_int(z);
  // The table begins one brick in, so that a position just below it does not round up into it.
  const RowInt bx = (cx >> 3) - 1, by = (cy >> 3) - 1, bz = (cz >> 3) - 1;
  Cell cell;
  cell.inside = (bx >= 0) & (by >= 0) & (bz >= 0) & (bx < grid.dims[0]) & (by < grid.dims[1]) & (bz < grid.dims[2]);
  cell.brick = (bx * grid.dims[1] + by) * grid.dims[2] + bz;
  cell.corner = ((cx & 7) * kBrickSamples + (cy & 7)) * kBrickSamples + (cz & 7);
  cell.tx = x - to_float(cx);
  cell.ty = y - to_float(cy);
  cell.tz = z - to_float(cz);
  return cell;
}

// Finds the lanes' corners. Lanes without a brick keep their pointer to unused values. Returns the bits of the missing
// lanes.
OSTEON_INLINE unsigned corners_of(const GridPlace& grid, const Cell& cell, unsigned wanted, const float** at) {
  unsigned missing = 0;
  alignas(64) std::int32_t brick[kLanes], inside[kLanes], corner[kLanes];
  std::memcpy(brick, &cell.brick, sizeof brick);
  std::memcpy(inside, &cell.inside, sizeof inside);
  std::memcpy(corner, &cell.corner, sizeof corner);
  for (int i = 0; i < kLanes; ++i) {
    if (!(wanted >> i & 1u)) continue;
    const float* values = inside[i] ? grid.bricks[brick[i]] : nullptr;
    if (values)
      at[i] = values + corner[i];
    else
      missing |= 1u << i;
  }
  return missing;
}

OSTEON_INLINE void trilinear(const float* const* at, Row tx, Row ty, Row tz, Row& value, Row& gx, Row& gy, Row& gz) {
  constexpr int kY = kBrickSamples, kX = kBrickSamples * kBrickSamples;
  Row v000, v001, v010, v011, v100, v101, v110, v111;
  two_rows(at, 0, v000, v001);
  two_rows(at, kY, v010, v011);
  two_rows(at, kX, v100, v101);
  two_rows(at, kX + kY, v110, v111);
  const Row d00 = v001 - v000, d01 = v011 - v010, d10 = v101 - v100, d11 = v111 - v110;
  const Row c00 = v000 + tz * d00, c01 = v010 + tz * d01, c10 = v100 + tz * d10, c11 = v110 + tz * d11;
  const Row e0 = c01 - c00, e1 = c11 - c10, b0 = c00 + ty * e0, b1 = c10 + ty * e1;
  const Row f0 = d00 + ty * (d01 - d00), f1 = d10 + ty * (d11 - d10);
  gx = b1 - b0;
  value = b0 + tx * gx;
  gy = e0 + tx * (e1 - e0);
  gz = f0 + tx * (f1 - f0);
}

OSTEON_INLINE Row lanes_of(unsigned bits, Row yes, Row no) {
  RowInt mask{};
  for (int i = 0; i < kLanes; ++i) mask[i] = bits >> i & 1u ? -1 : 0;
  return mask ? yes : no;
}

OSTEON_INLINE unsigned bits_of(RowInt mask) {
  unsigned bits = 0;
  for (int i = 0; i < kLanes; ++i) bits |= static_cast<unsigned>(mask[i] & 1) << i;
  return bits;
}

struct RowSums {
  Row area{}, engaged{}, density{}, milling{}, arm{}, turned{}, edge{}, fx{}, fy{}, fz{}, mx{}, my{}, mz{};
  Row nearest;
};

OSTEON_INLINE void add_up(const ContactSet& set, const Task& task, std::size_t first, Row qx, Row qy, Row qz,
                          Row facing, RowInt counts, Row distance, Row density, RowSums& sums) {
  const Row nothing{};
  const Row area = load(&set.area_mm2[first]), arm = load(&set.arm_mm[first]);
  const Row projected = counts ? area * facing : nothing;
  const RowInt in_bone = counts & (distance < 0.0f);
  const Row engaged = in_bone ? projected : nothing;
  sums.area += projected;
  sums.nearest = low(sums.nearest, distance);
  sums.engaged += engaged;
  sums.turned += in_bone ? area : nothing;
  sums.edge += in_bone ? load(&set.edge[first]) : nothing;
  sums.arm += engaged * arm;
  const Row weight = engaged * density;
  sums.density += weight;
  if (task.strength) {
    const Row at = density * static_cast<float>(kDensitySteps / kMostDensity_g_cm3);
    const Row most = splat(static_cast<float>(kDensitySteps));
    const Row within = low(at, most);
    const RowInt step = trunc_to_int(within);
    const Row t = within - to_float(step);
    Row below{}, above{};
    for (int i = 0; i < kLanes; ++i) {
      below[i] = task.strength[step[i]];
      above[i] = task.strength[step[i] + 1];
    }
    sums.milling += engaged / arm * (below + t * (above - below));
  }
  const Row wx = weight * load(&set.nx[first]), wy = weight * load(&set.ny[first]), wz = weight * load(&set.nz[first]);
  sums.fx -= wx;
  sums.fy -= wy;
  sums.fz -= wz;
  sums.mx -= qy * wz - qz * wy;
  sums.my -= qz * wx - qx * wz;
  sums.mz -= qx * wy - qy * wx;
}

OSTEON_INLINE double total(Row row) {
  double sum = 0.0;
  for (int i = 0; i < kLanes; ++i) sum += static_cast<double>(row[i]);
  return sum;
}

static void evaluate(const ContactSet& set, const Task& task, ContactValues& values, Totals& result) {
  constexpr unsigned kAll = kLanes == 32 ? ~0u : (1u << kLanes) - 1u;
  RowSums sums;
  sums.nearest = splat(kLeftOut_mm);
  const float(&r)[9] = task.rotation;
  for (int group = task.first_group; group < task.last_group; ++group) {
    const auto g = static_cast<std::size_t>(group);
    const std::size_t from = g * kGroupPoints;
    const float far = task.bound(set.balls[g]);
    if (far > task.margin) {
      for (std::size_t i = from; i < from + kGroupPoints; i += kLanes) {
        store(&values.distance_mm[i], splat(far));
        store(&values.gx[i], Row{});
        store(&values.gy[i], Row{});
        store(&values.gz[i], Row{});
        if (task.density) store(&values.density_g_cm3[i], Row{});
        if (!task.ahead) continue;
        const Row facing =
            load(&set.nx[i]) * task.toward[0] + load(&set.ny[i]) * task.toward[1] + load(&set.nz[i]) * task.toward[2];
        sums.area += facing >= task.least_facing ? load(&set.area_mm2[i]) * facing : Row{};
      }
      sums.nearest = low(sums.nearest, splat(far));
      values.nearest_mm[g] = far;
      continue;
    }
    Row least = splat(kLeftOut_mm);
    for (std::size_t i = from; i < from + kGroupPoints; i += kLanes) {
      const Row nx = load(&set.nx[i]), ny = load(&set.ny[i]), nz = load(&set.nz[i]);
      const Row qx = load(&set.x[i]) + nx * task.lift, qy = load(&set.y[i]) + ny * task.lift,
                qz = load(&set.z[i]) + nz * task.lift;
      Row px = ((qx * r[0] + qy * r[1]) + qz * r[2]) + splat(task.at[0]);
      Row py = ((qx * r[3] + qy * r[4]) + qz * r[5]) + splat(task.at[1]);
      Row pz = ((qx * r[6] + qy * r[7]) + qz * r[8]) + splat(task.at[2]);
      Row facing{};
      RowInt counts = splat_int(-1);
      unsigned wanted = kAll;
      if (task.ahead) {
        facing = (nx * task.toward[0] + ny * task.toward[1]) + nz * task.toward[2];
        counts = facing >= task.least_facing;
        wanted = bits_of(counts);
        const Row reach = low(splat(task.ahead_mm) / (counts ? facing : splat(1.0f)), splat(task.most_mm));
        px += reach * task.direction[0];
        py += reach * task.direction[1];
        pz += reach * task.direction[2];
      }
      Row distance = splat(kLeftOut_mm), gx{}, gy{}, gz{}, density{};
      if (wanted) {
        const float* at[kLanes];
        for (int lane = 0; lane < kLanes; ++lane) at[lane] = kNothing;
        Cell cell = cell_of(task.fine, px, py, pz);
        unsigned missing = corners_of(task.fine, cell, wanted, at);
        Row inverse = splat(task.fine.inverse_pitch);
        Cell coarse;
        bool has_coarse = false;
        unsigned unknown = 0;
        if (missing) {
          coarse = cell_of(task.coarse, px, py, pz);
          has_coarse = true;
          unknown = corners_of(task.coarse, coarse, missing, at);
          cell.tx = lanes_of(missing, coarse.tx, cell.tx);
          cell.ty = lanes_of(missing, coarse.ty, cell.ty);
          cell.tz = lanes_of(missing, coarse.tz, cell.tz);
          inverse = lanes_of(missing, splat(task.coarse.inverse_pitch), inverse);
        }
        trilinear(at, cell.tx, cell.ty, cell.tz, distance, gx, gy, gz);
        gx *= inverse;
        gy *= inverse;
        gz *= inverse;
        if (unknown) {
          // Free by the case's clearance, or unknown.
          for (int lane = 0; lane < kLanes; ++lane) {
            if (!(unknown >> lane & 1u)) continue;
            const float bound = task.clearance_at(px[lane], py[lane], pz[lane]);
            if (bound > 0.0f)
              distance[lane] = bound;
            else
              values.covered = false;
          }
          gx = lanes_of(unknown, Row{}, gx);
          gy = lanes_of(unknown, Row{}, gy);
          gz = lanes_of(unknown, Row{}, gz);
        }
        if (wanted != kAll) {
          distance = counts ? distance : splat(kLeftOut_mm);
          gx = counts ? gx : Row{};
          gy = counts ? gy : Row{};
          gz = counts ? gz : Row{};
        }
        if (task.density) {
          const RowInt in_bone = counts & (distance < 0.0f);
          if (const unsigned bone = bits_of(in_bone)) {
            if (!has_coarse) coarse = cell_of(task.dense, px, py, pz);
            for (int lane = 0; lane < kLanes; ++lane) at[lane] = kNothing;
            const unsigned none = corners_of(task.dense, coarse, bone, at);
            Row ux, uy, uz;
            trilinear(at, coarse.tx, coarse.ty, coarse.tz, density, ux, uy, uz);
            density = in_bone ? density : Row{};
            if (none) density = lanes_of(none, Row{}, density);
          }
        }
      }
      store(&values.distance_mm[i], distance);
      store(&values.gx[i], gx);
      store(&values.gy[i], gy);
      store(&values.gz[i], gz);
      if (task.density) store(&values.density_g_cm3[i], density);
      least = low(least, distance);
      if (task.ahead) add_up(set, task, i, qx, qy, qz, facing, counts, distance, density, sums);
    }
    float nearest = least[0];
    for (int lane = 1; lane < kLanes; ++lane) nearest = least[lane] < nearest ? least[lane] : nearest;
    values.nearest_mm[g] = nearest;
  }
  const Row* const rows[] = {&sums.area,   &sums.engaged, &sums.density, &sums.milling, &sums.arm,
                             &sums.turned, &sums.edge,    &sums.fx,      &sums.fy,      &sums.fz,
                             &sums.mx,     &sums.my,      &sums.mz};
  for (int i = 0; i < kTotals; ++i) result.sum[i] = total(*rows[i]);
  for (int lane = 0; lane < kLanes; ++lane)
    if (sums.nearest[lane] < result.nearest) result.nearest = sums.nearest[lane];
}

static void hull_distance(const float* rotation, const float* at, const float* faces, int count, const float* const* p,
                          float* distance) {
  for (int from = 0; from < kGroupPoints; from += kLanes) {
    Row q[3];
    const Row x = load(p[0] + from), y = load(p[1] + from), z = load(p[2] + from);
    for (int k = 0; k < 3; ++k)
      q[k] = ((x * rotation[3 * k] + y * rotation[3 * k + 1]) + z * rotation[3 * k + 2]) + splat(at[k]);
    Row farthest = splat(-kLeftOut_mm);
    for (int i = 0; i < count; ++i) {
      const float* const face = faces + 4 * i;
      const Row to_plane = ((q[0] * face[0] + q[1] * face[1]) + q[2] * face[2]) - splat(face[3]);
      farthest = farthest < to_plane ? to_plane : farthest;
    }
    store(distance + from, farthest);
  }
}
