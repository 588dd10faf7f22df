#include "common/surface/seams.hpp"

#include <algorithm>
#include <cmath>

namespace osteon {
namespace {

constexpr int kSlab = kBlockApron * kBlockApron, kRow = kBlockApron;
constexpr std::array<int, 3> kStride{kSlab, kRow, 1};

int gathered(const std::array<int, 3>& at) { return (at[0] + 1) * kSlab + (at[1] + 1) * kRow + at[2] + 1; }

// Half blocks on both sides of a position, numbered as in SeamRule. A plane between two half blocks has both, a
// position inside has one.
constexpr int first_half(int place) { return (place + 1) / 2; }
constexpr int last_half(int place) { return place / 2 + 1; }

// The value with the sign that the determining contour gives it.
float on_side(float value, bool solid) {
  if ((value < 0.0f) == solid) return value;
  return solid ? -1e-6f : 1e-6f;
}

// The samples of each kind of position: first to last along an axis.
constexpr std::array<int, 5> kFirst{0, 1, 8, 9, 16}, kLast{0, 7, 8, 15, 16};

class Ruling {
 public:
  Ruling(std::span<float> values, int cells) : f_(values), cells_(cells) {}

  // Samples on coarse edges are linear; the sign changes at the vertex.
  void edge(const std::array<int, 3>& at, int axis) {
    const auto k = static_cast<std::size_t>(axis);
    std::array<int, 3> from = at, to = at;
    from[k] = at[k] / cells_ * cells_;
    to[k] = from[k] + cells_;
    const float a = f_[static_cast<std::size_t>(gathered(from))], b = f_[static_cast<std::size_t>(gathered(to))];
    const int along = at[k] - from[k];
    const float value = a + (b - a) * static_cast<float>(along) / static_cast<float>(cells_);
    bool solid = a < 0.0f;
    if (solid != (b < 0.0f) && kEdgePlaces * along >= cells_ * edge_place(a, b)) solid = !solid;
    f_[static_cast<std::size_t>(gathered(at))] = on_side(value, solid);
  }

  // All samples inside one coarse face whose edges are done. u and v are its axes.
  void face(const std::array<int, 3>& origin, int u, int v) {
    const int first = gathered(origin), du = kStride[static_cast<std::size_t>(u)],
              dv = kStride[static_cast<std::size_t>(v)];
    const auto value = [&](int i, int j) -> float& { return f_[static_cast<std::size_t>(first + i * du + j * dv)]; };
    const int n = cells_;
    // Where the contour enters and leaves, in half cells: midway between the fine samples on both sides.
    std::array<std::array<int, 2>, 4> ends;
    std::size_t count = 0;
    for (int i = 0; i < n; ++i) {
      const auto end = [&](float a, float b, std::array<int, 2> place) {
        if ((a < 0.0f) != (b < 0.0f) && count < ends.size()) ends[count++] = place;
      };
      end(value(i, 0), value(i + 1, 0), {2 * i + 1, 0});
      end(value(i, n), value(i + 1, n), {2 * i + 1, 2 * n});
      end(value(0, i), value(0, i + 1), {0, 2 * i + 1});
      end(value(n, i), value(n, i + 1), {2 * n, 2 * i + 1});
    }
    const float f00 = value(0, 0), f01 = value(0, n), f10 = value(n, 0), f11 = value(n, n);
    const bool solid00 = f00 < 0.0f;
    for (int i = 1; i < n; ++i)
      for (int j = 1; j < n; ++j) {
        bool solid = solid00;
        if (count == 2) {
          const auto side = [&](int a, int b) {
            return (ends[1][0] - ends[0][0]) * (b - ends[0][1]) - (ends[1][1] - ends[0][1]) * (a - ends[0][0]);
          };
          // A sample on the line itself is solid.
          const int here = side(2 * i, 2 * j), corner = side(0, 0);
          solid = here == 0 || ((here > 0) == (corner > 0)) == solid00;
        } else if (count == 4) {
          solid = false;  // two diagonally opposite solid corners stay separate
        }
        const float s = static_cast<float>(i) / static_cast<float>(n),
                    t = static_cast<float>(j) / static_cast<float>(n);
        value(i, j) = on_side((1 - s) * ((1 - t) * f00 + t * f01) + s * ((1 - t) * f10 + t * f11), solid);
      }
  }

 private:
  std::span<float> f_;
  int cells_;
};

}  // namespace

int Seams::most() const { return *std::ranges::max_element(coarser); }

SeamRule::SeamRule(const Seams& seams) : any_(seams.most() > 0) {
  if (!any_) return;
  for (int x = 0; x < 5; ++x)
    for (int y = 0; y < 5; ++y)
      for (int z = 0; z < 5; ++z) {
        std::uint8_t most = 0;
        for (int i = first_half(x); i <= last_half(x); ++i)
          for (int j = first_half(y); j <= last_half(y); ++j)
            for (int k = first_half(z); k <= last_half(z); ++k)
              most = std::max(most, seams.coarser[static_cast<std::size_t>((i * 4 + j) * 4 + k)]);
        steps_[static_cast<std::size_t>((x * 5 + y) * 5 + z)] = most;
      }
}

void take_coarse_contour(const SeamRule& rule, std::span<float> values) {
  for (int steps = kSeamSteps; steps > 0; --steps) {
    const int cells = 1 << steps;
    Ruling ruling(values, cells);
    for (const bool faces : {false, true})
      for (int px = 0; px < 5; ++px)
        for (int py = 0; py < 5; ++py)
          for (int pz = 0; pz < 5; ++pz) {
            if (rule.steps(px, py, pz) != steps) continue;
            const auto first = [](int p) { return kFirst[static_cast<std::size_t>(p)]; };
            const auto last = [](int p) { return kLast[static_cast<std::size_t>(p)]; };
            for (int x = first(px); x <= last(px); ++x)
              for (int y = first(py); y <= last(py); ++y)
                for (int z = first(pz); z <= last(pz); ++z) {
                  const std::array<int, 3> at{x, y, z};
                  int off = 0, axis = 0;
                  for (int k = 0; k < 3; ++k)
                    if (at[static_cast<std::size_t>(k)] % cells != 0) {
                      ++off;
                      axis = k;
                    }
                  if (!faces && off == 1) ruling.edge(at, axis);
                  if (!faces || off != 2) continue;
                  // Once for each coarse face, at its first inner sample.
                  std::array<int, 3> origin = at;
                  std::array<int, 2> axes{};
                  std::size_t n = 0;
                  bool is_first = true;
                  for (int k = 0; k < 3; ++k) {
                    int& c = origin[static_cast<std::size_t>(k)];
                    if (c % cells == 0) continue;
                    is_first &= c % cells == 1;
                    c = c / cells * cells;
                    axes[n++] = k;
                  }
                  if (is_first) ruling.face(origin, axes[0], axes[1]);
                }
          }
  }
}

}  // namespace osteon
