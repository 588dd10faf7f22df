// The replicated arithmetic. Everything here must give the same bytes on every compiler and processor: only + − × ÷
// and square roots (correctly rounded by IEEE 754), comparisons, and conversions of in-range numbers to integers.
#include "common/field/kernel.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/check.hpp"

namespace osteon {
namespace {

// std::sqrt is the one function taken from the library: IEEE 754 fixes its result.
float root(float x) { return std::sqrt(x); }
double root(double x) { return std::sqrt(x); }

float low(float a, float b) { return b < a ? b : a; }
float high(float a, float b) { return a < b ? b : a; }
float clamp(float x, float lowest, float highest) { return low(high(x, lowest), highest); }

struct Rotation {
  double x, y, z, w;
};

Rotation normalised(double x, double y, double z, double w) {
  const double length = root(x * x + y * y + z * z + w * w);
  if (!(length > 0.0)) return {0.0, 0.0, 0.0, 1.0};
  return {x / length, y / length, z / length, w / length};
}

// Third column of the rotation matrix: where the tool's +z points.
void tool_axis(const Rotation& q, double axis[3]) {
  axis[0] = 2.0 * (q.x * q.z + q.w * q.y);
  axis[1] = 2.0 * (q.y * q.z - q.w * q.x);
  axis[2] = 1.0 - 2.0 * (q.x * q.x + q.y * q.y);
}

double length_of(const double from[3], const double to[3]) {
  const double dx = to[0] - from[0], dy = to[1] - from[1], dz = to[2] - from[2];
  return root(dx * dx + dy * dy + dz * dz);
}

// Distance to the drill's outline at distance r from the axis and place s along it (tip at 0, body at s < 0), the
// flutes made longer by `stretch`.
float drill_distance(const SweptTool::Body& body, float r, float s, float stretch) {
  const float bottom = -body.length - stretch;
  const float cone = (r * body.tip_height + s * body.radius) / body.slant;
  const float inside = high(high(cone, r - body.radius), bottom - s);

  // Nearest point of each of the three edges: cone, side, back.
  const float edge_r = body.radius / body.slant, edge_s = -body.tip_height / body.slant;
  const float w = clamp(r * edge_r + s * edge_s, 0.0f, body.slant);
  const float cone_r = r - w * edge_r, cone_s = s - w * edge_s;
  const float side_r = r - body.radius, side_s = s - clamp(s, bottom, -body.tip_height);
  const float back_r = r - clamp(r, 0.0f, body.radius), back_s = s - bottom;
  const float outside = root(low(low(cone_r * cone_r + cone_s * cone_s, side_r * side_r + side_s * side_s),
                                 back_r * back_r + back_s * back_s));
  return inside <= 0.0f ? inside : outside;
}

float sphere_sweep_distance(const SweptTool::Body& body, const SweptTool::Sweep& sweep, float px, float py, float pz) {
  const float mx = sweep.motion_mm[0], my = sweep.motion_mm[1], mz = sweep.motion_mm[2];
  const float squared = mx * mx + my * my + mz * mz;
  const float t = squared > 0.0f ? clamp((px * mx + py * my + pz * mz) / squared, 0.0f, 1.0f) : 0.0f;
  const float qx = px - t * mx, qy = py - t * my, qz = pz - t * mz;
  return root(qx * qx + qy * qy + qz * qz) - body.radius;
}

// The point split into its parts along and across the drill's axis. Across is kept as a vector: the difference of two
// large squares would lose the millimetres near the axis.
struct AxialPoint {
  float s, x, y, z;
};

AxialPoint axial(const SweptTool::Sweep& sweep, float px, float py, float pz) {
  const float* a = sweep.axis;
  const float s = px * a[0] + py * a[1] + pz * a[2];
  return {s, px - s * a[0], py - s * a[1], pz - s * a[2]};
}

// A motion along the axis stretches the drill: exact, one evaluation.
float axial_sweep_distance(const SweptTool::Body& body, const SweptTool::Sweep& sweep, float px, float py, float pz) {
  const AxialPoint p = axial(sweep, px, py, pz);
  const float forward = high(sweep.along_mm, 0.0f);
  const float stretch = sweep.along_mm < 0.0f ? -sweep.along_mm : sweep.along_mm;
  return drill_distance(body, root(p.x * p.x + p.y * p.y + p.z * p.z), p.s - forward, stretch);
}

// Distance to a convex body is convex along a line, so golden-section search finds the nearest pose. The number of
// steps is fixed by the cut, and leaves an error below half a quantum because distances change at most as fast as the
// pose moves.
float oblique_sweep_distance(const SweptTool::Body& body, const SweptTool::Sweep& sweep, float px, float py, float pz) {
  const AxialPoint p = axial(sweep, px, py, pz);
  const AxialPoint m = axial(sweep, sweep.motion_mm[0], sweep.motion_mm[1], sweep.motion_mm[2]);
  const auto at = [&](float t) {
    const float x = p.x - t * m.x, y = p.y - t * m.y, z = p.z - t * m.z;
    return drill_distance(body, root(x * x + y * y + z * z), p.s - t * m.s, 0.0f);
  };
  constexpr float kGolden = 0.61803399f;
  float left = 0.0f, right = 1.0f;
  float a = right - kGolden * (right - left), b = left + kGolden * (right - left);
  float fa = at(a), fb = at(b);
  float best = low(low(at(0.0f), at(1.0f)), low(fa, fb));
  for (int i = 0; i < sweep.search_steps; ++i) {
    if (fa < fb) {
      right = b;
      b = a;
      fb = fa;
      a = right - kGolden * (right - left);
      fa = at(a);
      best = low(best, fa);
    } else {
      left = a;
      a = b;
      fa = fb;
      b = left + kGolden * (right - left);
      fb = at(b);
      best = low(best, fb);
    }
  }
  return best;
}

float sweep_distance(const SweptTool::Body& body, const SweptTool::Sweep& sweep, float px, float py, float pz) {
  if (body.kind == CutKind::ball) return sphere_sweep_distance(body, sweep, px, py, pz);
  if (sweep.search_steps == 0) return axial_sweep_distance(body, sweep, px, py, pz);
  return oblique_sweep_distance(body, sweep, px, py, pz);
}

// Rounds to the nearest quantum, halves away from zero; + 0.0f turns −0 into 0.
float to_quantum(float mm) {
  const float scaled = mm * 1024.0f;
  const auto steps = static_cast<std::int32_t>(scaled < 0.0f ? scaled - 0.5f : scaled + 0.5f);
  return static_cast<float>(steps) * (1.0f / 1024.0f) + 0.0f;
}

float centre_distance(const SweptTool::Body& body, const SweptTool::Sweep& sweep, Coord origin, double pitch) {
  constexpr double kMiddle = 0.5 * (kLeafSize - 1);
  return sweep_distance(body, sweep, static_cast<float>((origin.x + kMiddle) * pitch - sweep.start_mm[0]),
                        static_cast<float>((origin.y + kMiddle) * pitch - sweep.start_mm[1]),
                        static_cast<float>((origin.z + kMiddle) * pitch - sweep.start_mm[2]));
}

// A leaf whose centre is farther away than this has every sample beyond the band: half its diagonal, the band, and
// room for the rounding of single-precision distances.
float leaf_reach(double pitch) {
  return band_mm(pitch) + static_cast<float>(0.8660254037844387 * kLeafSize * pitch + 0.001);
}

template <class Distance>
int cut_samples(const SweptTool::Sweep& sweep, Coord origin, double pitch, float band,
                std::span<float, kLeafVoxels> values, Distance distance) {
  float pz[kLeafSize];
  for (int z = 0; z < kLeafSize; ++z) pz[z] = static_cast<float>((origin.z + z) * pitch - sweep.start_mm[2]);
  int modified = 0;
  float* value = values.data();
  for (int x = 0; x < kLeafSize; ++x) {
    const float px = static_cast<float>((origin.x + x) * pitch - sweep.start_mm[0]);
    for (int y = 0; y < kLeafSize; ++y, value += kLeafSize) {
      const float py = static_cast<float>((origin.y + y) * pitch - sweep.start_mm[1]);
      float cut[kLeafSize];
      for (int z = 0; z < kLeafSize; ++z) cut[z] = to_quantum(clamp(distance(px, py, pz[z]), -band, band));
      for (int z = 0; z < kLeafSize; ++z) {
        modified += cut[z] < value[z] ? 1 : 0;
        value[z] = low(value[z], cut[z]);
      }
    }
  }
  return modified;
}

}  // namespace

SweptTool::SweptTool(const Cut& cut, const CutBody& body, double pitch_mm)
    : body_{body.kind, 0.0f, 0.0f, static_cast<float>(-body.lowest[2]) / 1024.0f, 0.0f},
      level_pitch_mm_(osteon::level_pitch_mm(pitch_mm, cut.level)) {
  OSTEON_CHECK(!cut.path.empty() && cut.level >= 0 && cut.level < kLevels && body.cuts());
  if (body.kind == CutKind::ball) {
    body_.radius = body_.tip_height = static_cast<float>(body.radius) / 1024.0f;
  } else {
    body_.radius = static_cast<float>(body.profile[3].r) / 1024.0f;
    body_.tip_height = static_cast<float>(-body.profile[3].z) / 1024.0f;
  }
  body_.slant = root(body_.radius * body_.radius + body_.tip_height * body_.tip_height);

  const auto position = [&](std::size_t i, double out[3]) {
    for (int k = 0; k < 3; ++k) out[k] = cut.path[i].position[static_cast<std::size_t>(k)] * kQuantum_mm;
  };
  const auto rotation = [&](std::size_t i) {
    const auto& q = cut.path[i].rotation;
    return normalised(q[0], q[1], q[2], q[3]);
  };
  const std::size_t segments = std::max<std::size_t>(1, cut.path.size() - 1);
  for (std::size_t i = 0; i < segments; ++i) {
    const std::size_t next = std::min(i + 1, cut.path.size() - 1);
    double from[3], to[3];
    position(i, from);
    position(next, to);
    const Rotation a = rotation(i);
    Rotation b = rotation(next);
    if (a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w < 0.0) b = {-b.x, -b.y, -b.z, -b.w};
    // A turn is cut at sub-poses between which no point of the cutting part moves by more than a quarter pitch:
    // half the angle is the chord between the quaternions, to second order.
    const double dx = b.x - a.x, dy = b.y - a.y, dz = b.z - a.z, dw = b.w - a.w;
    const double turn_mm = 2.0 * root(dx * dx + dy * dy + dz * dz + dw * dw) *
                           (static_cast<double>(body_.length) + static_cast<double>(body_.radius));
    const int parts = 1 + static_cast<int>(turn_mm / (0.25 * level_pitch_mm_));
    for (int part = 0; part < parts; ++part) {
      const double t0 = static_cast<double>(part) / parts, t1 = static_cast<double>(part + 1) / parts;
      const double middle = 0.5 * (t0 + t1);
      const Rotation q = normalised(a.x + middle * dx, a.y + middle * dy, a.z + middle * dz, a.w + middle * dw);
      double axis[3], start[3], end[3];
      tool_axis(q, axis);
      for (int k = 0; k < 3; ++k) {
        start[k] = from[k] + t0 * (to[k] - from[k]);
        end[k] = from[k] + t1 * (to[k] - from[k]);
      }
      if (body_.kind == CutKind::turned) {
        add_drill_sweep(start, end, axis);
      } else {
        const double radius = static_cast<double>(body_.radius);
        for (int k = 0; k < 3; ++k) {
          start[k] -= radius * axis[k];
          end[k] -= radius * axis[k];
        }
        add_sphere_sweep(start, end);
      }
    }
  }
}

void SweptTool::add_sphere_sweep(const double from[3], const double to[3]) {
  Sweep sweep{};
  for (int k = 0; k < 3; ++k) {
    sweep.start_mm[k] = from[k];
    sweep.motion_mm[k] = static_cast<float>(to[k] - from[k]);
    sweep.min_mm[k] = std::min(from[k], to[k]) - static_cast<double>(body_.radius);
    sweep.max_mm[k] = std::max(from[k], to[k]) + static_cast<double>(body_.radius);
  }
  sweeps_.push_back(sweep);
}

void SweptTool::add_drill_sweep(const double from[3], const double to[3], const double axis[3]) {
  Sweep sweep{};
  double along = 0.0, motion[3], across[3];
  for (int k = 0; k < 3; ++k) {
    motion[k] = to[k] - from[k];
    along += motion[k] * axis[k];
  }
  for (int k = 0; k < 3; ++k) across[k] = motion[k] - along * axis[k];
  const double sideways = root(across[0] * across[0] + across[1] * across[1] + across[2] * across[2]);
  // A hand that drills straight moves sideways only by the rounding of its poses. Then half of that rounding is put
  // on the start, and the rest of the motion is along the axis.
  const bool straight = sideways <= 2.0 * kQuantum_mm;
  for (int k = 0; k < 3; ++k) {
    sweep.start_mm[k] = straight ? from[k] + 0.5 * across[k] : from[k];
    sweep.motion_mm[k] = static_cast<float>(motion[k]);
    sweep.axis[k] = static_cast<float>(axis[k]);
    const double back = static_cast<double>(body_.length) * axis[k], radius = static_cast<double>(body_.radius);
    sweep.min_mm[k] = std::min({from[k], to[k], from[k] - back, to[k] - back}) - radius;
    sweep.max_mm[k] = std::max({from[k], to[k], from[k] - back, to[k] - back}) + radius;
  }
  sweep.along_mm = static_cast<float>(along);
  if (!straight) {
    double interval = length_of(from, to);
    while (interval > 0.5 * kQuantum_mm) {
      interval *= 0.61803399;
      ++sweep.search_steps;
    }
    sweep.search_steps = std::max(1, sweep.search_steps);
  }
  sweeps_.push_back(sweep);
}

std::vector<Coord> SweptTool::leaves() const {
  std::vector<Coord> found;
  const double leaf_mm = kLeafSize * level_pitch_mm_, band = static_cast<double>(band_mm(level_pitch_mm_));
  const float reach = leaf_reach(level_pitch_mm_);
  for (const Sweep& sweep : sweeps_) {
    std::int32_t lowest[3], highest[3];
    for (int k = 0; k < 3; ++k) {
      lowest[k] = static_cast<std::int32_t>(std::floor((sweep.min_mm[k] - band) / leaf_mm));
      highest[k] = static_cast<std::int32_t>(std::floor((sweep.max_mm[k] + band) / leaf_mm));
    }
    for (std::int32_t x = lowest[0]; x <= highest[0]; ++x)
      for (std::int32_t y = lowest[1]; y <= highest[1]; ++y)
        for (std::int32_t z = lowest[2]; z <= highest[2]; ++z) {
          const Coord origin{x * kLeafSize, y * kLeafSize, z * kLeafSize};
          if (centre_distance(body_, sweep, origin, level_pitch_mm_) < reach) found.push_back(origin);
        }
  }
  std::ranges::sort(found);
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

int SweptTool::cut_leaf(Coord origin, std::span<float, kLeafVoxels> values) const {
  const float band = band_mm(level_pitch_mm_);
  const double pitch = level_pitch_mm_;
  const float reach = leaf_reach(pitch);
  int modified = 0;
  for (const Sweep& sweep : sweeps_) {
    if (centre_distance(body_, sweep, origin, pitch) >= reach) continue;  // every sample would be at the band
    // Copies: a compiler that knows that no value written can be one of them keeps them in registers.
    if (body_.kind == CutKind::ball) {
      modified += cut_samples(sweep, origin, pitch, band, values, [body = body_, sweep](float x, float y, float z) {
        return sphere_sweep_distance(body, sweep, x, y, z);
      });
    } else if (sweep.search_steps == 0) {
      modified += cut_samples(sweep, origin, pitch, band, values, [body = body_, sweep](float x, float y, float z) {
        return axial_sweep_distance(body, sweep, x, y, z);
      });
    } else {
      modified += cut_samples(sweep, origin, pitch, band, values, [body = body_, sweep](float x, float y, float z) {
        return oblique_sweep_distance(body, sweep, x, y, z);
      });
    }
  }
  return modified;
}

float SweptTool::distance_mm(const Vec3& point) const {
  float nearest = 1e9f;
  for (const Sweep& sweep : sweeps_)
    nearest = low(nearest, sweep_distance(body_, sweep, static_cast<float>(point.x() - sweep.start_mm[0]),
                                          static_cast<float>(point.y() - sweep.start_mm[1]),
                                          static_cast<float>(point.z() - sweep.start_mm[2])));
  return nearest;
}

}  // namespace osteon
