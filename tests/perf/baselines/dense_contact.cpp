#include "tests/perf/baselines/dense_contact.hpp"

#include <cstddef>

namespace osteon::baselines {
namespace {

constexpr int kChunk = 256;  // points at a time, so that what lies between the loops stays in the nearest cache

inline float least(float a, float b) { return a < b ? a : b; }

// What lies between the loops, for each point of a chunk: its place in the bone's frame and in the tool's, and samples.
struct Between {
  float px[kChunk], py[kChunk], pz[kChunk], qx[kChunk], qy[kChunk], qz[kChunk], facing[kChunk], counts[kChunk];
  float f[kChunk], gx[kChunk], gy[kChunk], gz[kChunk], rho[kChunk], unused[3][kChunk];
};

void place(const PointArrays& points, const ContactTask& task, int first, int n, Between& b) {
  const float* x = points.x.data() + first;
  const float* y = points.y.data() + first;
  const float* z = points.z.data() + first;
  const float* nx = points.nx.data() + first;
  const float* ny = points.ny.data() + first;
  const float* nz = points.nz.data() + first;
  const auto [r0, r1, r2, r3, r4, r5, r6, r7, r8] = task.rotation;
  const auto [ax, ay, az] = task.position_mm;
  const auto [dx, dy, dz] = task.direction;
  const auto [wx, wy, wz] = task.toward;
  const float lift = task.lift_mm, ahead = task.ahead_mm, furthest = task.most_mm, faces = task.least_facing;
  for (int i = 0; i < n; ++i) {
    const float facing = nx[i] * wx + ny[i] * wy + nz[i] * wz, counts = facing >= faces ? 1.0f : 0.0f;
    const float reach = facing >= faces ? least(ahead / facing, furthest) : 0.0f;
    const float qx = x[i] + lift * nx[i], qy = y[i] + lift * ny[i], qz = z[i] + lift * nz[i];
    b.px[i] = r0 * qx + r1 * qy + r2 * qz + ax + reach * dx;
    b.py[i] = r3 * qx + r4 * qy + r5 * qz + ay + reach * dy;
    b.pz[i] = r6 * qx + r7 * qy + r8 * qz + az + reach * dz;
    b.qx[i] = qx;
    b.qy[i] = qy;
    b.qz[i] = qz;
    b.facing[i] = facing;
    b.counts[i] = counts;
  }
}

// Value and gradient of a grid at n positions, trilinear.
void sample(const DenseGrid& grid, int n, const float* __restrict px, const float* __restrict py,
            const float* __restrict pz, float* __restrict value, float* __restrict gx, float* __restrict gy,
            float* __restrict gz) {
  const float* __restrict values = grid.values.data();
  const float inverse = 1.0f / grid.pitch_mm, x0 = grid.origin_mm[0], y0 = grid.origin_mm[1], z0 = grid.origin_mm[2];
  const int step_y = grid.dims[2], step_x = grid.dims[1] * grid.dims[2];
  for (int p = 0; p < n; ++p) {
    const float x = (px[p] - x0) * inverse, y = (py[p] - y0) * inverse, z = (pz[p] - z0) * inverse;
    const int i = static_cast<int>(x), j = static_cast<int>(y), k = static_cast<int>(z);
    const float tx = x - static_cast<float>(i), ty = y - static_cast<float>(j), tz = z - static_cast<float>(k);
    const int o = i * step_x + j * step_y + k;
    const float v000 = values[o], v001 = values[o + 1], v010 = values[o + step_y], v011 = values[o + step_y + 1];
    const float v100 = values[o + step_x], v101 = values[o + step_x + 1], v110 = values[o + step_x + step_y],
                v111 = values[o + step_x + step_y + 1];
    const float d00 = v001 - v000, d01 = v011 - v010, d10 = v101 - v100, d11 = v111 - v110;
    const float c00 = v000 + tz * d00, c01 = v010 + tz * d01, c10 = v100 + tz * d10, c11 = v110 + tz * d11;
    const float e0 = c01 - c00, e1 = c11 - c10, b0 = c00 + ty * e0, b1 = c10 + ty * e1;
    const float f0 = d00 + ty * (d01 - d00), f1 = d10 + ty * (d11 - d10);
    value[p] = b0 + tx * (b1 - b0);
    gx[p] = (b1 - b0) * inverse;
    gy[p] = (e0 + tx * (e1 - e0)) * inverse;
    gz[p] = (f0 + tx * (f1 - f0)) * inverse;
  }
}

// Leaves out what faces away, and density outside the bone.
void store(const ContactTask& task, int first, int n, Between& b, PointValues& values) {
  float* __restrict distance = values.distance_mm.data() + first;
  float* __restrict gx = values.gx.data() + first;
  float* __restrict gy = values.gy.data() + first;
  float* __restrict gz = values.gz.data() + first;
  float* __restrict density = values.density_g_cm3.data() + first;
  const float left_out = task.left_out_mm;
  for (int i = 0; i < n; ++i) {
    const float f = b.counts[i] > 0.0f ? b.f[i] : left_out, rho = f < 0.0f ? b.rho[i] : 0.0f;
    b.f[i] = f;
    b.rho[i] = rho;
    distance[i] = f;
    gx[i] = b.counts[i] * b.gx[i];
    gy[i] = b.counts[i] * b.gy[i];
    gz[i] = b.counts[i] * b.gz[i];
    density[i] = rho;
  }
}

void add_up(const PointArrays& points, const ContactTask& task, int first, int n, const Between& b, ContactTotals& to) {
  const float* nx = points.nx.data() + first;
  const float* ny = points.ny.data() + first;
  const float* nz = points.nz.data() + first;
  const float* areas = points.area_mm2.data() + first;
  const float* arms = points.arm_mm.data() + first;
  const float* edges = points.edge.data() + first;
  const float* strength = task.strength;
  const auto steps = static_cast<float>(task.strength_steps), per_density = steps / task.most_density_g_cm3;
  float area = 0, engaged = 0, density = 0, milling = 0, arm = 0, turned = 0, edge = 0, nearest = to.nearest;
  float fx = 0, fy = 0, fz = 0, mx = 0, my = 0, mz = 0;
  for (int i = 0; i < n; ++i) {
    const float in_bone = b.f[i] < 0.0f ? 1.0f : 0.0f;
    const float projected = areas[i] * b.facing[i], part = in_bone * projected, weight = part * b.rho[i];
    nearest = least(nearest, b.f[i]);
    area += b.counts[i] * projected;
    engaged += part;
    turned += in_bone * areas[i];
    edge += in_bone * edges[i];
    arm += part * arms[i];
    density += weight;
    const float s = least(b.rho[i] * per_density, steps);
    const int below = static_cast<int>(s);
    const float at = strength[below], t = s - static_cast<float>(below);
    milling += part / arms[i] * (at + t * (strength[below + 1] - at));
    const float ux = weight * nx[i], uy = weight * ny[i], uz = weight * nz[i];
    fx -= ux;
    fy -= uy;
    fz -= uz;
    mx -= b.qy[i] * uz - b.qz[i] * uy;
    my -= b.qz[i] * ux - b.qx[i] * uz;
    mz -= b.qx[i] * uy - b.qy[i] * ux;
  }
  to.area += area;
  to.engaged += engaged;
  to.density += density;
  to.milling += milling;
  to.arm += arm;
  to.turned += turned;
  to.edge += edge;
  to.nearest = nearest;
  to.force = {to.force[0] + fx, to.force[1] + fy, to.force[2] + fz};
  to.torque = {to.torque[0] + mx, to.torque[1] + my, to.torque[2] + mz};
}

}  // namespace

ContactTotals dense_contact(const DenseGrid& solid, const DenseGrid& density, const PointArrays& points,
                            const ContactTask& task, PointValues& values) {
  ContactTotals totals;
  totals.nearest = task.left_out_mm;
  const auto all = static_cast<int>(points.x.size());
  Between b;
  for (int first = 0; first < all; first += kChunk) {
    const int n = all - first < kChunk ? all - first : kChunk;
    place(points, task, first, n, b);
    sample(solid, n, b.px, b.py, b.pz, b.f, b.gx, b.gy, b.gz);
    sample(density, n, b.px, b.py, b.pz, b.rho, b.unused[0], b.unused[1], b.unused[2]);
    store(task, first, n, b, values);
    add_up(points, task, first, n, b, totals);
  }
  return totals;
}

}  // namespace osteon::baselines
