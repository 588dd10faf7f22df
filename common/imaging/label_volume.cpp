#include "common/imaging/label_volume.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <functional>
#include <thread>

#include "common/core/check.hpp"

namespace osteon::imaging {
namespace {

constexpr float kUnshrink = 1.02f;  // μ: slightly above the blur's 1, so that wanted detail survives 16 steps
constexpr int kDensityReach = 2;    // voxels beyond the bone that get its density

// Calls work(i) for i in [0, count) on all cores. One thread does each i, so results do not depend on the number of
// threads. False if keep_going, called from the caller's thread only, returned false.
bool each_in_parallel(int count, const std::function<void(int)>& work, const KeepGoing& keep_going) {
  std::atomic<int> next{0}, running{0};
  std::atomic<bool> stopped{false};
  const auto loop = [&] {
    for (int i = next++; i < count && !stopped; i = next++) work(i);
    --running;
  };
  std::vector<std::thread> helpers;
  const int threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  running = threads;
  for (int i = 0; i < threads; ++i) helpers.emplace_back(loop);
  while (running > 0) {
    if (!stopped && !keep_going(std::min(1.0, static_cast<double>(next) / std::max(1, count)))) stopped = true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  for (std::thread& helper : helpers) helper.join();
  // Called also if all work was done before the first call.
  return !stopped && keep_going(1.0);
}

tl::unexpected<Error> stopped_smoothing() { return stopped_while("smoothing the labels"); }

// Applies [1 2 1]/4 to `count` rows of `width` values each, `step` apart. Rows of values beyond the ends equal the end
// rows.
void filter_rows(float* values, std::ptrdiff_t step, int count, int width, std::vector<float>& before) {
  before.assign(values, values + width);
  for (int row = 0; row < count; ++row) {
    float* here = values + row * step;
    const float* after = row + 1 < count ? here + step : here;
    for (int i = 0; i < width; ++i) {
      const float old = here[i];
      here[i] = 0.25f * (before[static_cast<std::size_t>(i)] + 2.0f * old + after[i]);
      before[static_cast<std::size_t>(i)] = old;
    }
  }
}

void filter_line(float* line, int count) {
  float before = line[0];
  for (int i = 0; i < count; ++i) {
    const float old = line[i];
    line[i] = 0.25f * (before + 2.0f * old + line[std::min(i + 1, count - 1)]);
    before = old;
  }
}

// The two voxels around a sample, and its position from the first to the second.
struct LabelBracket {
  int low = 0, high = 0;
  float part = 0;
};

std::vector<LabelBracket> brackets(int first_sample, int last_sample, double pitch_mm, double spacing_mm,
                                   int first_voxel, int last_voxel) {
  std::vector<LabelBracket> out;
  for (int i = first_sample; i <= last_sample; ++i) {
    const double at =
        std::clamp(i * pitch_mm / spacing_mm, static_cast<double>(first_voxel), static_cast<double>(last_voxel));
    const int low = std::min(static_cast<int>(std::floor(at)), std::max(first_voxel, last_voxel - 1));
    out.push_back({low - first_voxel, std::min(low + 1, last_voxel) - first_voxel, static_cast<float>(at - low)});
  }
  return out;
}

}  // namespace

CoordBox bone_voxels(const LabelVolume& volume) {
  const CoordBox& all = volume.labels.box;
  CoordBox box{all.max, all.min};
  const std::uint8_t* label = volume.labels.values.data();
  for (int x = all.min.x; x <= all.max.x; ++x)
    for (int y = all.min.y; y <= all.max.y; ++y)
      for (int z = all.min.z; z <= all.max.z; ++z)
        if (*label++ != 0) {
          box.min = {std::min(box.min.x, x), std::min(box.min.y, y), std::min(box.min.z, z)};
          box.max = {std::max(box.max.x, x), std::max(box.max.y, y), std::max(box.max.z, z)};
        }
  return box;
}

Result<DenseVolume<float>> smooth_labels(const LabelVolume& volume, const SmoothingParams& params,
                                         const KeepGoing& keep_going) {
  const DenseVolume<std::uint8_t>& labels = volume.labels;
  const Coord n = labels.box.dims();
  OSTEON_CHECK(!labels.box.empty() && params.rounds >= 0 && params.least >= 0.0f && params.least < 1.0f);
  DenseVolume<float> field;
  field.box = labels.box;
  field.values.resize(labels.values.size());
  std::ranges::transform(labels.values, field.values.begin(),
                         [](std::uint8_t label) { return label != 0 ? 1.0f : -1.0f; });

  const std::ptrdiff_t plane = static_cast<std::ptrdiff_t>(n.y) * n.z;
  std::vector<float> blurred(field.values.size());
  for (int step = 0; step < 2 * params.rounds; ++step) {
    const bool sharpen = step % 2 == 1;
    const auto part = [&](double begin, double end) {
      return [&, begin, end](double f) { return keep_going((step + begin + (end - begin) * f) / (2 * params.rounds)); };
    };
    // Along y and z in planes of one x, then along x in columns of one y. The second pass also applies the bound.
    const bool first = each_in_parallel(
        n.x,
        [&](int x) {
          thread_local std::vector<float> before;
          float* values = blurred.data() + x * plane;
          std::copy_n(field.values.data() + x * plane, plane, values);
          filter_rows(values, n.z, n.y, n.z, before);
          for (int y = 0; y < n.y; ++y) filter_line(values + static_cast<std::ptrdiff_t>(y) * n.z, n.z);
        },
        part(0.0, 0.5));
    if (!first) return stopped_smoothing();
    const bool second = each_in_parallel(
        n.y,
        [&](int y) {
          thread_local std::vector<float> before;
          const std::ptrdiff_t start = static_cast<std::ptrdiff_t>(y) * n.z;
          filter_rows(blurred.data() + start, plane, n.x, n.z, before);
          for (int x = 0; x < n.x; ++x)
            for (std::ptrdiff_t i = start + x * plane; i < start + x * plane + n.z; ++i) {
              const auto at = static_cast<std::size_t>(i);
              const float value =
                  sharpen ? field.values[at] + kUnshrink * (field.values[at] - blurred[at]) : blurred[at];
              field.values[at] =
                  labels.values[at] != 0 ? std::max(value, params.least) : std::min(value, -params.least);
            }
        },
        part(0.5, 1.0));
    if (!second) return stopped_smoothing();
  }
  return field;
}

Result<DenseVolume<float>> resample(const DenseVolume<float>& field, const Vec3& spacing_mm, const CoordBox& box,
                                    double pitch_mm, const KeepGoing& keep_going) {
  const CoordBox& from = field.box;
  const auto xs = brackets(box.min.x, box.max.x, pitch_mm, spacing_mm.x(), from.min.x, from.max.x);
  const auto ys = brackets(box.min.y, box.max.y, pitch_mm, spacing_mm.y(), from.min.y, from.max.y);
  const auto zs = brackets(box.min.z, box.max.z, pitch_mm, spacing_mm.z(), from.min.z, from.max.z);
  DenseVolume<float> out(box, 0.0f);
  const std::ptrdiff_t row = from.dims().z, plane = row * from.dims().y;
  const bool done = each_in_parallel(
      static_cast<int>(xs.size()),
      [&](int x) {
        float* value =
            out.values.data() + static_cast<std::ptrdiff_t>(x) * static_cast<std::ptrdiff_t>(ys.size() * zs.size());
        const LabelBracket& i = xs[static_cast<std::size_t>(x)];
        for (const LabelBracket& j : ys) {
          const float* line[4] = {
              field.values.data() + i.low * plane + j.low * row, field.values.data() + i.low * plane + j.high * row,
              field.values.data() + i.high * plane + j.low * row, field.values.data() + i.high * plane + j.high * row};
          const float weight[4] = {(1.0f - i.part) * (1.0f - j.part), (1.0f - i.part) * j.part,
                                   i.part * (1.0f - j.part), i.part * j.part};
          const auto at = [&](int k) {
            return weight[0] * line[0][k] + weight[1] * line[1][k] + weight[2] * line[2][k] + weight[3] * line[3][k];
          };
          for (const LabelBracket& k : zs)
            *value++ = k.part == 0.0f ? at(k.low) : (1.0f - k.part) * at(k.low) + k.part * at(k.high);
        }
      },
      keep_going);
  if (!done) return stopped_smoothing();
  return out;
}

Result<DenseVolume<float>> label_density(const LabelVolume& volume, std::span<const float> density_g_cm3,
                                         const CoordBox& box, double pitch_mm, const KeepGoing& keep_going) {
  // For voxels that are not bone: the largest label within reach, along one axis after the other.
  const Coord n = volume.labels.box.dims();
  const std::ptrdiff_t strides[3] = {static_cast<std::ptrdiff_t>(n.y) * n.z, n.z, 1};
  const int sizes[3] = {n.x, n.y, n.z};
  std::vector<std::uint8_t> spread = volume.labels.values;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;  // v has the smaller stride of the other two
    const bool done = each_in_parallel(
        sizes[u],
        [&](int i) {
          thread_local std::vector<std::uint8_t> line;
          line.resize(static_cast<std::size_t>(sizes[axis]));
          for (int j = 0; j < sizes[v]; ++j) {
            std::uint8_t* at = spread.data() + i * strides[u] + j * strides[v];
            for (int k = 0; k < sizes[axis]; ++k) line[static_cast<std::size_t>(k)] = at[k * strides[axis]];
            for (int k = 0; k < sizes[axis]; ++k) {
              if (line[static_cast<std::size_t>(k)] != 0) continue;
              std::uint8_t most = 0;
              const int end = std::min(sizes[axis] - 1, k + kDensityReach);
              for (int m = std::max(0, k - kDensityReach); m <= end; ++m)
                most = std::max(most, line[static_cast<std::size_t>(m)]);
              at[k * strides[axis]] = most;
            }
          }
        },
        [&](double f) { return keep_going(0.25 * (axis + f)); });
    if (!done) return stopped_smoothing();
  }

  const CoordBox& from = volume.labels.box;
  const auto nearest = [&](int first, int last, double spacing, int low, int high) {
    std::vector<std::ptrdiff_t> out;
    for (int i = first; i <= last; ++i)
      out.push_back(std::clamp(static_cast<int>(std::lround(i * pitch_mm / spacing)), low, high) - low);
    return out;
  };
  const auto xs = nearest(box.min.x, box.max.x, volume.spacing_mm.x(), from.min.x, from.max.x);
  const auto ys = nearest(box.min.y, box.max.y, volume.spacing_mm.y(), from.min.y, from.max.y);
  const auto zs = nearest(box.min.z, box.max.z, volume.spacing_mm.z(), from.min.z, from.max.z);
  DenseVolume<float> out(box, 0.0f);
  const bool done = each_in_parallel(
      static_cast<int>(xs.size()),
      [&](int x) {
        float* value =
            out.values.data() + static_cast<std::ptrdiff_t>(x) * static_cast<std::ptrdiff_t>(ys.size() * zs.size());
        for (const std::ptrdiff_t y : ys) {
          const std::uint8_t* line = spread.data() + xs[static_cast<std::size_t>(x)] * strides[0] + y * strides[1];
          for (const std::ptrdiff_t z : zs) *value++ = density_g_cm3[line[z]];
        }
      },
      [&](double f) { return keep_going(0.75 + 0.25 * f); });
  if (!done) return stopped_smoothing();
  return out;
}

}  // namespace osteon::imaging
