// A part of kernel.cpp, which includes it once for each register width: kLanes samples at a time. For every width, each
// lane does the same operations in the same order.

typedef float Row __attribute__((vector_size(kLanes * 4)));
typedef std::int32_t RowInt __attribute__((vector_size(kLanes * 4)));

OSTEON_INLINE Row splat(float x) { return x - Row{}; }
OSTEON_INLINE RowInt trunc_to_int(Row x) { return __builtin_convertvector(x, RowInt); }

#if OSTEON_LANES == 16
// Masked with all lanes, because gcc 12 warns about an undefined operand inside the plain forms.
OSTEON_INLINE Row root(Row x) { return _mm512_maskz_sqrt_ps(0xffff, x); }
OSTEON_INLINE Row low(Row a, Row b) { return _mm512_maskz_min_ps(0xffff, b, a); }   // b < a ? b : a
OSTEON_INLINE Row high(Row a, Row b) { return _mm512_maskz_max_ps(0xffff, b, a); }  // a < b ? b : a
OSTEON_INLINE bool any_below(Row a, Row b) { return _mm512_cmp_ps_mask(a, b, _CMP_LT_OQ) != 0; }
OSTEON_INLINE int count_below(Row a, Row b) { return __builtin_popcount(_mm512_cmp_ps_mask(a, b, _CMP_LT_OQ)); }
#elif OSTEON_LANES == 8
OSTEON_INLINE Row root(Row x) { return _mm256_sqrt_ps(x); }
OSTEON_INLINE Row low(Row a, Row b) { return _mm256_min_ps(b, a); }
OSTEON_INLINE Row high(Row a, Row b) { return _mm256_max_ps(b, a); }
OSTEON_INLINE int mask_below(Row a, Row b) { return _mm256_movemask_ps(_mm256_cmp_ps(a, b, _CMP_LT_OQ)); }
OSTEON_INLINE bool any_below(Row a, Row b) { return mask_below(a, b) != 0; }
OSTEON_INLINE int count_below(Row a, Row b) { return __builtin_popcount(static_cast<unsigned>(mask_below(a, b))); }
#elif defined(__SSE2__)
OSTEON_INLINE Row root(Row x) { return _mm_sqrt_ps(x); }
OSTEON_INLINE Row low(Row a, Row b) { return _mm_min_ps(b, a); }
OSTEON_INLINE Row high(Row a, Row b) { return _mm_max_ps(b, a); }
OSTEON_INLINE int mask_below(Row a, Row b) { return _mm_movemask_ps(_mm_cmplt_ps(a, b)); }
OSTEON_INLINE bool any_below(Row a, Row b) { return mask_below(a, b) != 0; }
OSTEON_INLINE int count_below(Row a, Row b) { return __builtin_popcount(static_cast<unsigned>(mask_below(a, b))); }
#else
OSTEON_INLINE Row root(Row x) {
  Row y{};
  for (int i = 0; i < kLanes; ++i) y[i] = std::sqrt(x[i]);
  return y;
}
OSTEON_INLINE Row low(Row a, Row b) { return b < a ? b : a; }
OSTEON_INLINE Row high(Row a, Row b) { return a < b ? b : a; }
OSTEON_INLINE int count_below(Row a, Row b) {
  int count = 0;
  for (int i = 0; i < kLanes; ++i) count += a[i] < b[i] ? 1 : 0;
  return count;
}
OSTEON_INLINE bool any_below(Row a, Row b) { return count_below(a, b) != 0; }
#endif

OSTEON_INLINE Row load(const float* from) {
  Row x;
  std::memcpy(&x, from, sizeof x);
  return x;
}
OSTEON_INLINE void store(float* to, Row x) { std::memcpy(to, &x, sizeof x); }
OSTEON_INLINE Row clamp(Row x, float lowest, float highest) { return low(high(x, splat(lowest)), splat(highest)); }
OSTEON_INLINE Row dot(Row x, Row y, Row z, const float* a) { return (x * a[0] + y * a[1]) + z * a[2]; }

// Distance to a capsule: the ball at the point of the centre's path that is nearest to the sample.
OSTEON_INLINE Row ball_distance(const ToolSweep& s, Row px, Row py, Row pz) {
  const Row t = clamp(dot(px, py, pz, s.motion_mm) * s.inverse_square, 0.0f, 1.0f);
  const Row x = px - t * s.motion_mm[0], y = py - t * s.motion_mm[1], z = pz - t * s.motion_mm[2];
  return root((x * x + y * y) + z * z) - s.radius;
}

// Distance to a convex outline at distance r from the axis and position s along it. Inside, the nearest line determines
// it; outside, the nearest edge.
OSTEON_INLINE Row outline_distance(const OutlineEdge* edges, std::uint32_t count, Row r, Row s) {
  Row inside = splat(-1e9f), outside = splat(1e18f);
  for (std::uint32_t i = 0; i < count; ++i) {
    const OutlineEdge e = edges[i];
    const Row dr = r - e.r, ds = s - e.s;
    inside = high(inside, dr * e.es - ds * e.er);
    const Row along = clamp(dr * e.er + ds * e.es, 0.0f, e.length);
    const Row qr = dr - along * e.er, qs = ds - along * e.es;
    outside = low(outside, qr * qr + qs * qs);
  }
  return inside > 0.0f ? root(outside) : inside;
}

// The edges of a turned body that matter in a leaf.
struct Turned {
  OutlineEdge edges[kMostOutlineEdges];
  std::uint32_t count;
};

template <bool kDome>
OSTEON_INLINE Row turned_distance(const ToolSweep& s, const Turned& turned, Row u, Row v, Row along) {
  const Row square = u * u + v * v;
  const Row r = root(square);
  Row distance = outline_distance(turned.edges, turned.count, r, along);
  if (kDome) {
    // The ball's centre moves with the sweep, so along the axis the ball is a capsule. If a ball and an outline do not
    // meet, they must not meet when stretched: nothing may be wider than the body.
    const Row centre = along + s.dome;
    const Row up = centre - clamp(centre, s.down_mm, s.up_mm);
    distance = high(high(distance, root(square + up * up) - s.dome), r - s.radius);
  }
  return distance;
}

template <bool kDome>
OSTEON_INLINE Row axial_distance(const ToolSweep& s, const Turned& turned, Row px, Row py, Row pz) {
  return turned_distance<kDome>(s, turned, dot(px, py, pz, s.u), dot(px, py, pz, s.v), dot(px, py, pz, s.axis));
}

template <bool kDome>
OSTEON_INLINE Row across_distance(const ToolSweep& s, const Turned& turned, Row px, Row py, Row pz) {
  const Row u = dot(px, py, pz, s.u);
  return turned_distance<kDome>(s, turned, u - clamp(u, 0.0f, s.across_mm), dot(px, py, pz, s.v),
                                dot(px, py, pz, s.axis));
}

// No search is needed if even the nearest pose is at least `enough` away from the sample, or if the sample is deeper
// than the band in the middle pose.
template <bool kDome>
OSTEON_INLINE Row oblique_distance(const ToolSweep& s, const Turned& turned, Row px, Row py, Row pz, float enough,
                                   float band) {
  const Row u = dot(px, py, pz, s.u), v = dot(px, py, pz, s.v), w = dot(px, py, pz, s.axis);
  const auto at = [&](Row t) OSTEON_INLINE_LAMBDA {
    return turned_distance<kDome>(s, turned, u - t * s.across_mm, v, w - t * s.along_mm);
  };
  Row best = at(splat(0.5f));
  // A distance changes at most as fast as the pose moves: half the motion, from the middle.
  const RowInt wanted = (best + band > 0.0f) & (best < splat(enough + 0.5f * s.length_mm + 0.001f));
  if (!any_below(splat(0.0f), wanted ? splat(1.0f) : splat(0.0f))) return best;
  constexpr float kGolden = 0.61803399f;
  Row left = splat(0.0f), right = splat(1.0f);
  Row a = splat(1.0f - kGolden), b = splat(kGolden);
  Row fa = at(a), fb = at(b);
  best = low(best, low(fa, fb));
  for (int i = 0; i < s.search_steps; ++i) {
    const RowInt nearer_a = fa < fb;
    right = nearer_a ? b : right;
    left = nearer_a ? left : a;
    const Row way = kGolden * (right - left);
    const Row t = nearer_a ? right - way : left + way;
    const Row f = at(t);
    best = low(best, f);
    const Row old_a = a, old_fa = fa;
    a = nearer_a ? t : b;
    fa = nearer_a ? f : fb;
    b = nearer_a ? old_a : t;
    fb = nearer_a ? old_fa : f;
  }
  return best;
}

OSTEON_INLINE Row hull_distance(const SweptPlane* planes, std::uint32_t count, Row px, Row py, Row pz) {
  Row distance = splat(-1e9f);
  for (std::uint32_t i = 0; i < count; ++i) {
    const SweptPlane p = planes[i];
    distance = high(distance, ((px * p.x + py * p.y) - p.offset) + pz * p.z);
  }
  return distance;
}

// Trilinear in the lattice. Outside its box, the distance is at least the value at the nearest point of the box. It is
// also at least the distance to the box plus the smallest value on its faces. Neither bound grows faster than the
// distance itself.
OSTEON_INLINE Row sampled_distance(const ToolSweep& s, const SweptTool::Body& body, Row px, Row py, Row pz) {
  const SampledDistance& lattice = *body.sampled;
  const Coord dims = lattice.box.dims();
  const float pitch = static_cast<float>(lattice.pitch) * (1.0f / 1024.0f);
  const float per_mm = 1.0f / pitch;
  const Row at[3] = {dot(px, py, pz, s.u), dot(px, py, pz, s.v), dot(px, py, pz, s.axis)};
  const std::int32_t first[3] = {lattice.box.min.x, lattice.box.min.y, lattice.box.min.z};
  const std::int32_t size[3] = {dims.x, dims.y, dims.z};
  Row weight[3], square = splat(0.0f);
  RowInt index[3];
  for (int k = 0; k < 3; ++k) {
    const Row from_first = at[k] * per_mm - static_cast<float>(first[k]);
    const Row within = clamp(from_first, 0.0f, static_cast<float>(size[k] - 1));
    const Row past = (from_first - within) * pitch;
    square = square + past * past;
    const Row cell = low(__builtin_convertvector(trunc_to_int(within), Row), splat(static_cast<float>(size[k] - 2)));
    index[k] = trunc_to_int(cell);
    weight[k] = within - cell;
  }
  const RowInt place = (index[0] * size[1] + index[1]) * size[2] + index[2];
  const std::size_t sy = static_cast<std::size_t>(size[2]), sx = static_cast<std::size_t>(size[1]) * sy;
  float corner[8][kLanes];
  for (int i = 0; i < kLanes; ++i) {
    const std::int16_t* p = lattice.values.data() + place[i];
    const std::int16_t* around[4] = {p, p + sy, p + sx, p + sx + sy};
    for (int k = 0; k < 4; ++k) {
      corner[2 * k][i] = static_cast<float>(around[k][0]);
      corner[2 * k + 1][i] = static_cast<float>(around[k][1]);
    }
  }
  Row line[4];
  for (int k = 0; k < 4; ++k)
    line[k] = load(corner[2 * k]) + weight[2] * (load(corner[2 * k + 1]) - load(corner[2 * k]));
  const Row near_x = line[0] + weight[1] * (line[1] - line[0]), far_x = line[2] + weight[1] * (line[3] - line[2]);
  const Row inside = (near_x + weight[0] * (far_x - near_x)) * (1.0f / 1024.0f);
  return square > 0.0f ? high(inside, root(square) + body.sampled_outside) : inside;
}

// Distances of a sweep at separate points.
inline Row distance_at(const ToolSweep& s, const SweptTool::Body& body, Row px, Row py, Row pz) {
  switch (s.kind) {
    case SweepKind::ball:
      return ball_distance(s, px, py, pz);
    case SweepKind::hull:
      return hull_distance(body.planes.data() + s.first, s.count, px, py, pz);
    case SweepKind::sampled:
      return sampled_distance(s, body, px, py, pz);
    default:
      break;
  }
  Turned turned;
  turned.count = s.count;
  std::copy_n(body.edges.data() + s.first, s.count, turned.edges);
  constexpr float kFar = 1e9f;
  if (s.dome > 0.0f) {
    if (s.kind == SweepKind::axial) return axial_distance<true>(s, turned, px, py, pz);
    if (s.kind == SweepKind::across) return across_distance<true>(s, turned, px, py, pz);
    return oblique_distance<true>(s, turned, px, py, pz, kFar, kFar);
  }
  if (s.kind == SweepKind::axial) return axial_distance<false>(s, turned, px, py, pz);
  if (s.kind == SweepKind::across) return across_distance<false>(s, turned, px, py, pz);
  return oblique_distance<false>(s, turned, px, py, pz, kFar, kFar);
}

// Distances at the middles of `count` leaves in a line along z.
void middles(const ToolSweep& s, const SweptTool::Body& body, Coord first, int count, double pitch, float* out) {
  constexpr double kMiddle = 0.5 * (kLeafSize - 1);
  const Row px = splat(static_cast<float>((first.x + kMiddle) * pitch - s.start_mm[0]));
  const Row py = splat(static_cast<float>((first.y + kMiddle) * pitch - s.start_mm[1]));
  for (int i = 0; i < count; i += kLanes) {
    float z[kLanes], distance[kLanes];
    for (int lane = 0; lane < kLanes; ++lane)
      z[lane] = static_cast<float>((first.z + kMiddle + kLeafSize * (i + lane)) * pitch - s.start_mm[2]);
    store(distance, distance_at(s, body, px, py, load(z)));
    std::copy_n(distance, std::min(kLanes, count - i), out + i);
  }
}

float point_distance(const ToolSweep& s, const SweptTool::Body& body, const double point[3]) {
  Row p[3];
  for (int k = 0; k < 3; ++k) p[k] = splat(static_cast<float>(point[k] - s.start_mm[k]));
  float distance[kLanes];
  store(distance, distance_at(s, body, p[0], p[1], p[2]));
  return distance[0];
}

float highest(const float* values) {
  Row most = load(values);
  for (int i = kLanes; i < kLeafVoxels; i += kLanes) most = high(most, load(values + i));
  float lanes[kLanes];
  store(lanes, most);
  return *std::max_element(lanes, lanes + kLanes);
}

// Positions of a leaf's samples relative to a sweep's start.
struct LeafPlaces {
  float x[kLeafSize], y[kLeafSize], z[kLeafSize];
};

// Half the distance between the outermost samples of a bar of two rows of samples (1 x 2 x 8 samples), in pitches.
constexpr float kBarRadius = 3.5356f;
constexpr int kBars = kLeafVoxels / (2 * kLeafSize);

// Limits by which a bar can be skipped. The distance at its middle is known, and it changes by at most `radius` in the
// bar.
struct Spare {
  float radius, enough, band;
};

// Evaluates bars of two rows of samples. `middle` is the same distance, but exact also where `distance` skips a search.
template <class Distance, class Middle>
OSTEON_INLINE void each_bar(const LeafPlaces& at, bool first, const Spare& spare, float* distances, Distance distance,
                            Middle middle) {
  float middles_mm[kBars];
  const Row mz = splat(0.5f * (at.z[3] + at.z[4]));
  for (int bar = 0; bar < kBars; bar += kLanes) {
    float x[kLanes], y[kLanes];
    for (int lane = 0; lane < kLanes; ++lane) {
      x[lane] = at.x[(bar + lane) / 4];
      y[lane] = 0.5f * (at.y[2 * ((bar + lane) % 4)] + at.y[2 * ((bar + lane) % 4) + 1]);
    }
    store(middles_mm + bar, middle(load(x), load(y), mz));
  }
  for (int bar = 0; bar < kBars; ++bar) {
    float* out = distances + 2 * kLeafSize * bar;
    const bool far = middles_mm[bar] - spare.radius >= spare.enough,
               deep = middles_mm[bar] + spare.radius <= -spare.band;
    if (far && !first) continue;
    if (far || deep) {
      std::fill_n(out, 2 * kLeafSize, deep ? -spare.band : spare.band);
      continue;
    }
    const Row px = splat(at.x[bar / 4]);
    for (int i = 0; i < 2 * kLeafSize; i += kLanes) {
      float py[kLanes], pz[kLanes];
      for (int lane = 0; lane < kLanes; ++lane) {
        py[lane] = at.y[2 * (bar % 4) + (i + lane) / kLeafSize];
        pz[lane] = at.z[(i + lane) % kLeafSize];
      }
      const Row d = distance(px, load(py), load(pz));
      store(out + i, first ? d : low(load(out + i), d));
    }
  }
}

template <class Distance>
OSTEON_INLINE void each_row(const LeafPlaces& at, bool first, float* distances, Distance distance) {
  constexpr int kRowsAtOnce = kLanes >= kLeafSize ? kLanes / kLeafSize : 1;
  for (int x = 0; x < kLeafSize; ++x) {
    const Row px = splat(at.x[x]);
    for (int y = 0; y < kLeafSize; y += kRowsAtOnce) {
      float py[kLanes];
      for (int lane = 0; lane < kLanes; ++lane) py[lane] = at.y[y + lane / kLeafSize];
      for (int z = 0; z < kLeafSize; z += kLanes) {
        float pz[kLanes];
        for (int lane = 0; lane < kLanes; ++lane) pz[lane] = at.z[z + lane % kLeafSize];
        float* out = distances + (x * kLeafSize + y) * kLeafSize + z;
        const Row d = distance(px, load(py), load(pz));
        store(out, first ? d : low(load(out), d));
      }
    }
  }
}

// Edges that can be the nearest somewhere in the leaf. Their distance from its middle exceeds that of the nearest edge
// by at most twice the leaf's radius (plus the tool's motion).
Turned near_edges(const ToolSweep& s, const SweptTool::Body& body, const LeafPlaces& at, float radius) {
  const float px = 0.5f * (at.x[3] + at.x[4]), py = 0.5f * (at.y[3] + at.y[4]), pz = 0.5f * (at.z[3] + at.z[4]);
  const auto along = [&](const float* a) { return (px * a[0] + py * a[1]) + pz * a[2]; };
  const float half = s.kind == SweepKind::axial ? 0.0f : 0.5f;
  const float risen = s.kind == SweepKind::oblique ? 0.5f * s.along_mm : 0.0f;
  const float u = along(s.u) - half * s.across_mm, v = along(s.v), w = along(s.axis) - risen;
  const float r = std::sqrt(u * u + v * v);
  float distance[kMostOutlineEdges], least = 1e9f;
  const OutlineEdge* edges = body.edges.data() + s.first;
  for (std::uint32_t i = 0; i < s.count; ++i) {
    const OutlineEdge& e = edges[i];
    const float dr = r - e.r, ds = w - e.s;
    const float t = std::min(std::max(dr * e.er + ds * e.es, 0.0f), e.length);
    const float qr = dr - t * e.er, qs = ds - t * e.es;
    distance[i] = std::sqrt(qr * qr + qs * qs);
    least = std::min(least, distance[i]);
  }
  const float moved = s.kind == SweepKind::axial ? 0.0f : s.length_mm;
  Turned turned;
  turned.count = 0;
  for (std::uint32_t i = 0; i < s.count; ++i)
    if (distance[i] <= least + 2.0f * radius + moved) turned.edges[turned.count++] = edges[i];
  return turned;
}

template <bool kDome>
void turned_rows(const ToolSweep& s, const Turned& turned, const LeafPlaces& at, bool first, const Spare& spare,
                 float* distances) {
  if (s.kind == SweepKind::axial) {
    const auto distance = [&](Row x, Row y, Row z)
                              OSTEON_INLINE_LAMBDA { return axial_distance<kDome>(s, turned, x, y, z); };
    each_bar(at, first, spare, distances, distance, distance);
  } else if (s.kind == SweepKind::across) {
    const auto distance = [&](Row x, Row y, Row z)
                              OSTEON_INLINE_LAMBDA { return across_distance<kDome>(s, turned, x, y, z); };
    each_bar(at, first, spare, distances, distance, distance);
  } else {
    constexpr float kFar = 1e9f;
    each_bar(
        at, first, spare, distances,
        [&](Row x, Row y, Row z)
            OSTEON_INLINE_LAMBDA { return oblique_distance<kDome>(s, turned, x, y, z, spare.enough, spare.band); },
        [&](Row x, Row y, Row z)
            OSTEON_INLINE_LAMBDA { return oblique_distance<kDome>(s, turned, x, y, z, kFar, kFar); });
  }
}

void hull_rows(const ToolSweep& s, const SweptTool::Body& body, const LeafPlaces& at, float radius, bool first,
               const Spare& spare, float* distances) {
  // Planes that can be the highest somewhere in the leaf.
  const float px = 0.5f * (at.x[3] + at.x[4]), py = 0.5f * (at.y[3] + at.y[4]), pz = 0.5f * (at.z[3] + at.z[4]);
  const SweptPlane* planes = body.planes.data() + s.first;
  float value[kMostSweptPlanes], most = -1e9f;
  for (std::uint32_t i = 0; i < s.count; ++i) {
    value[i] = ((px * planes[i].x + py * planes[i].y) - planes[i].offset) + pz * planes[i].z;
    most = std::max(most, value[i]);
  }
  SweptPlane kept[kMostSweptPlanes];
  std::uint32_t count = 0;
  for (std::uint32_t i = 0; i < s.count; ++i)
    if (value[i] >= most - 2.0f * radius) kept[count++] = planes[i];
  const auto distance = [&](Row x, Row y, Row z) OSTEON_INLINE_LAMBDA { return hull_distance(kept, count, x, y, z); };
  each_bar(at, first, spare, distances, distance, distance);
}

void evaluate(const ToolSweep& s, const SweptTool::Body& body, Coord origin, double pitch, float radius, bool first,
              float enough, float band, float* distances) {
  LeafPlaces at;
  for (int i = 0; i < kLeafSize; ++i) {
    at.x[i] = static_cast<float>((origin.x + i) * pitch - s.start_mm[0]);
    at.y[i] = static_cast<float>((origin.y + i) * pitch - s.start_mm[1]);
    at.z[i] = static_cast<float>((origin.z + i) * pitch - s.start_mm[2]);
  }
  // From a leaf's radius to a bar's. The remainder is the margin for rounding and search.
  const Spare spare{radius + (kBarRadius - 6.0621778f) * static_cast<float>(pitch), enough, band};
  if (s.kind == SweepKind::ball) {
    // A copy, so that the compiler knows that no store changes it, and keeps it in registers. For a ball, computing the
    // distance costs no more than testing whether it can be skipped.
    const ToolSweep ball = s;
    each_row(at, first, distances,
             [&](Row x, Row y, Row z) OSTEON_INLINE_LAMBDA { return ball_distance(ball, x, y, z); });
  } else if (s.kind == SweepKind::hull) {
    hull_rows(s, body, at, radius, first, spare, distances);
  } else if (s.kind == SweepKind::sampled) {
    const auto distance = [&](Row x, Row y, Row z) OSTEON_INLINE_LAMBDA { return sampled_distance(s, body, x, y, z); };
    each_bar(at, first, spare, distances, distance, distance);
  } else {
    const ToolSweep copy = s;
    const Turned turned = near_edges(s, body, at, radius);
    if (s.dome > 0.0f)
      turned_rows<true>(copy, turned, at, first, spare, distances);
    else
      turned_rows<false>(copy, turned, at, first, spare, distances);
  }
}

// values = min(values, distances), clipped and rounded to the nearest quantum, halves away from zero. + 0.0f turns −0
// into 0.
LeafChange take_lower(const float* distances, float band, float* values) {
  int modified = 0;
  Row most = splat(-band);
  for (int i = 0; i < kLeafVoxels; i += kLanes) {
    const Row scaled = clamp(load(distances + i), -band, band) * 1024.0f;
    const RowInt steps = trunc_to_int(scaled < 0.0f ? scaled - 0.5f : scaled + 0.5f);
    const Row cut = __builtin_convertvector(steps, Row) * (1.0f / 1024.0f) + 0.0f;
    const Row old = load(values + i);
    const int lower = count_below(cut, old);
    const Row now = low(old, cut);
    if (lower != 0) store(values + i, now);
    modified += lower;
    most = high(most, now);
  }
  return {modified, true, !any_below(splat(-band), most)};
}
