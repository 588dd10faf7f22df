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

// `x`, `y`, `z`: the first sample relative to the shape's start. n is a multiple of kRowStep, and the mask tells the
// compiler so: no loop has a remainder.
template <class Offsets>
void lower_ball(const SweptShape& shape, const Offsets& at, float x, float y, float z, int n,
                float* __restrict values) {
  n &= -kRowStep;
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
void lower_turned(const SweptShape& shape, const Offsets& at, float x, float y, float z, int n,
                  float* __restrict values) {
  n &= -kRowStep;
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

// The samples of a row along z that the tool's band may reach: those in a ball round a capsule, or in a cylinder round
// a turned body's axis, and in the tool's box. a z² + 2 b z + c ≤ 0 for z relative to the start.
class NearTool {
 public:
  explicit NearTool(const SweptShape& shape) : shape_(shape), inverse_pitch_(1.0f / shape.pitch_mm) {
    for (std::size_t k = 0; k < 3; ++k) middle_[k] = 0.5f * shape.motion[k];
    const auto [mx, my, mz] = middle_;
    reach_ = shape.radius + shape.band_mm + (shape.ball ? std::sqrt(mx * mx + my * my + mz * mz) : 0.0f);
    const float a = shape.ball ? 1.0f : shape.u[2] * shape.u[2] + shape.v[2] * shape.v[2];
    a_ = a < 1e-6f ? 0.0f : a;  // rows along the axis
    inverse_a_ = a_ > 0.0f ? 1.0f / a_ : 0.0f;
  }

  // Narrows from and to, in samples. False if nothing is left.
  bool clip(float x_mm, float y_mm, int& from, int& to) const {
    const float x = x_mm - shape_.start[0], y = y_mm - shape_.start[1];
    float b, c;
    if (shape_.ball) {
      const float dx = x - middle_[0], dy = y - middle_[1];
      b = -middle_[2];
      c = dx * dx + dy * dy + middle_[2] * middle_[2] - reach_ * reach_;
    } else {
      const float u = shape_.u[0] * x + shape_.u[1] * y, v = shape_.v[0] * x + shape_.v[1] * y;
      b = u * shape_.u[2] + v * shape_.v[2];
      c = u * u + v * v - reach_ * reach_;
    }
    const float root = b * b - a_ * c;
    if (a_ > 0.0f ? root < 0.0f : c > 0.0f) return false;
    float low = shape_.low[2], high = shape_.high[2];
    if (a_ > 0.0f) {
      const float half = std::sqrt(root);
      low = most(low, shape_.start[2] + (-b - half) * inverse_a_);
      high = least(high, shape_.start[2] + (-b + half) * inverse_a_);
    }
    const int first = static_cast<int>(std::ceil(low * inverse_pitch_)),
              last = static_cast<int>(std::floor(high * inverse_pitch_));
    from = from < first ? first : from;
    to = last < to ? last : to;
    return from <= to;
  }

 private:
  const SweptShape& shape_;
  std::array<float, 3> middle_{};
  float inverse_pitch_, reach_, a_, inverse_a_;
};

}  // namespace

void lower_plane(const SweptShape& shape, const DenseSamples& samples, int x, int first_y, int last_y) {
  const float pitch = shape.pitch_mm, x_mm = static_cast<float>(x) * pitch;
  const NearTool near(shape);
  const auto width = static_cast<std::size_t>(samples.max[1] - samples.min[1] + 1);
  const int lowest = samples.min[2], highest = samples.max[2];
  for (int y = first_y; y <= last_y; ++y) {
    const float y_mm = static_cast<float>(y) * pitch;
    int from = lowest, to = highest;
    if (!near.clip(x_mm, y_mm, from, to)) continue;
    float* row = samples.values +
                 (static_cast<std::size_t>(x - samples.min[0]) * width + static_cast<std::size_t>(y - samples.min[1])) *
                     static_cast<std::size_t>(samples.row);
    const int first = (from - lowest) / kRowStep * kRowStep, last = (to - lowest) / kRowStep * kRowStep + kRowStep;
    for (int at = first; at < last; at += kChunk)
      lower(shape, AlongRow{pitch}, x_mm, y_mm, static_cast<float>(lowest + at) * pitch,
            last - at < kChunk ? last - at : kChunk, row + at);
  }
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
