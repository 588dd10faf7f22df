#include "tests/perf/baselines/lowering.hpp"

#include <cmath>
#include <cstddef>

namespace osteon::baselines {
namespace {

constexpr int kChunk = 64;  // samples at a time: a plane of a leaf, or a part of a row

inline float least(float a, float b) { return a < b ? a : b; }
inline float most(float a, float b) { return a < b ? b : a; }
inline float stored(float distance, float band) {
  return std::nearbyint(most(-band, least(band, distance)) * 1024.0f) * (1.0f / 1024.0f);
}
inline float dot(const std::array<float, 3>& a, float x, float y, float z) { return a[0] * x + a[1] * y + a[2] * z; }

// Offsets of the samples of a chunk from its first one.
struct AlongRow {
  float pitch;
  [[nodiscard]] float y(int) const { return 0.0f; }
  [[nodiscard]] float z(int i) const { return static_cast<float>(i) * pitch; }
};
struct LeafPlane {
  float pitch;
  [[nodiscard]] float y(int i) const { return static_cast<float>(i >> 3) * pitch; }
  [[nodiscard]] float z(int i) const { return static_cast<float>(i & 7) * pitch; }
};

// `x`, `y`, `z`: the first sample relative to the shape's start.
template <class Offsets>
void lower_ball(const SweptShape& shape, const Offsets& at, float x, float y, float z, int n, float* values) {
  const auto [mx, my, mz] = shape.motion;
  const float inverse = shape.inverse_square, radius = shape.radius, band = shape.band_mm;
  for (int i = 0; i < n; ++i) {
    const float qy = y + at.y(i), qz = z + at.z(i);
    const float t = most(0.0f, least(1.0f, (x * mx + qy * my + qz * mz) * inverse));
    const float dx = x - t * mx, dy = qy - t * my, dz = qz - t * mz;
    values[i] = least(values[i], stored(std::sqrt(dx * dx + dy * dy + dz * dz) - radius, band));
  }
}

// The distance to the convex outline: beyond it to the nearest of its edges, within it to the nearest of their lines.
template <class Offsets>
void lower_turned(const SweptShape& shape, const Offsets& at, float x, float y, float z, int n, float* values) {
  float r[kChunk], s[kChunk], inside[kChunk], outside[kChunk];
  const float u0 = dot(shape.u, x, y, z), v0 = dot(shape.v, x, y, z), s0 = dot(shape.axis, x, y, z);
  const float uy = shape.u[1], uz = shape.u[2], vy = shape.v[1], vz = shape.v[2], sy = shape.axis[1],
              sz = shape.axis[2], band = shape.band_mm;
  for (int i = 0; i < n; ++i) {
    const float dy = at.y(i), dz = at.z(i);
    const float pu = u0 + dy * uy + dz * uz, pv = v0 + dy * vy + dz * vz;
    r[i] = std::sqrt(pu * pu + pv * pv);
    s[i] = s0 + dy * sy + dz * sz;
    inside[i] = -1e9f;
    outside[i] = 1e9f;
  }
  for (int k = 0; k < shape.edge_count; ++k) {
    const SweptShape::Edge e = shape.edges[static_cast<std::size_t>(k)];
    for (int i = 0; i < n; ++i) {
      const float dr = r[i] - e.r, ds = s[i] - e.s;
      const float along = most(0.0f, least(e.length, dr * e.er + ds * e.es));
      const float qr = dr - along * e.er, qs = ds - along * e.es;
      inside[i] = most(inside[i], dr * e.es - ds * e.er);
      outside[i] = least(outside[i], qr * qr + qs * qs);
    }
  }
  for (int i = 0; i < n; ++i) {
    const float beyond = std::sqrt(outside[i]);
    values[i] = least(values[i], stored(inside[i] > 0.0f ? beyond : inside[i], band));
  }
}

template <class Offsets>
void lower(const SweptShape& shape, const Offsets& at, float x, float y, float z, int n, float* values) {
  x -= shape.start[0];
  y -= shape.start[1];
  z -= shape.start[2];
  if (shape.ball)
    lower_ball(shape, at, x, y, z, n, values);
  else
    lower_turned(shape, at, x, y, z, n, values);
}

}  // namespace

RowSpan row_span(const SweptShape& shape, float x_mm, float y_mm) {
  constexpr RowSpan kNone{1.0f, 0.0f};
  const float x = x_mm - shape.start[0], y = y_mm - shape.start[1], z0 = shape.start[2];
  float a, b, c;  // a z² + 2 b z + c ≤ 0 for z relative to the start
  if (shape.ball) {
    // The ball round the capsule's middle.
    const float mx = 0.5f * shape.motion[0], my = 0.5f * shape.motion[1], mz = 0.5f * shape.motion[2];
    const float reach = shape.radius + shape.band_mm + std::sqrt(mx * mx + my * my + mz * mz);
    a = 1.0f;
    b = -mz;
    c = (x - mx) * (x - mx) + (y - my) * (y - my) + mz * mz - reach * reach;
  } else {
    // The cylinder round the axis.
    const float reach = shape.radius + shape.band_mm;
    const float u = shape.u[0] * x + shape.u[1] * y, v = shape.v[0] * x + shape.v[1] * y;
    a = shape.u[2] * shape.u[2] + shape.v[2] * shape.v[2];
    b = u * shape.u[2] + v * shape.v[2];
    c = u * u + v * v - reach * reach;
  }
  RowSpan span{shape.low[2], shape.high[2]};
  if (a < 1e-6f) return c > 0.0f ? kNone : span;
  const float root = b * b - a * c;
  if (root < 0.0f) return kNone;
  const float half = std::sqrt(root);
  span.from_mm = most(span.from_mm, z0 + (-b - half) / a);
  span.to_mm = least(span.to_mm, z0 + (-b + half) / a);
  return span;
}

void lower_row(const SweptShape& shape, float x_mm, float y_mm, float z_mm, int n, float* values) {
  for (int i = 0; i < n; i += kChunk)
    lower(shape, AlongRow{shape.pitch_mm}, x_mm, y_mm, z_mm + static_cast<float>(i) * shape.pitch_mm,
          n - i < kChunk ? n - i : kChunk, values + i);
}

void lower_leaf(const SweptShape& shape, float x_mm, float y_mm, float z_mm, float* values) {
  for (int x = 0; x < 8; ++x)
    lower(shape, LeafPlane{shape.pitch_mm}, x_mm + static_cast<float>(x) * shape.pitch_mm, y_mm, z_mm, kChunk,
          values + kChunk * x);
}

float distance_mm(const SweptShape& shape, float x_mm, float y_mm, float z_mm) {
  const float x = x_mm - shape.start[0], y = y_mm - shape.start[1], z = z_mm - shape.start[2];
  if (shape.ball) {
    const auto [mx, my, mz] = shape.motion;
    const float t = most(0.0f, least(1.0f, (x * mx + y * my + z * mz) * shape.inverse_square));
    const float dx = x - t * mx, dy = y - t * my, dz = z - t * mz;
    return std::sqrt(dx * dx + dy * dy + dz * dz) - shape.radius;
  }
  const float u = dot(shape.u, x, y, z), v = dot(shape.v, x, y, z), s = dot(shape.axis, x, y, z);
  const float r = std::sqrt(u * u + v * v);
  float inside = -1e9f, outside = 1e9f;
  for (int k = 0; k < shape.edge_count; ++k) {
    const SweptShape::Edge& e = shape.edges[static_cast<std::size_t>(k)];
    const float dr = r - e.r, ds = s - e.s, along = most(0.0f, least(e.length, dr * e.er + ds * e.es));
    const float qr = dr - along * e.er, qs = ds - along * e.es;
    inside = most(inside, dr * e.es - ds * e.er);
    outside = least(outside, qr * qr + qs * qs);
  }
  return inside > 0.0f ? std::sqrt(outside) : inside;
}

}  // namespace osteon::baselines
