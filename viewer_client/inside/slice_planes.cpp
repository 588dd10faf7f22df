#include "viewer_client/inside/slice_planes.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/core/check.hpp"
#include "common/radiology/slice.hpp"

namespace osteon {
namespace {

using radiology::PixelGrid;

constexpr double kNearlyParallel = 1e-9;

Vec3 right_of(const PixelGrid& plane) { return plane.column_mm.normalized(); }
Vec3 down_of(const PixelGrid& plane) { return plane.row_mm.normalized(); }

// Squares of an image in which the outline of a solid is looked for.
class Outline {
 public:
  Outline(const PixelGrid& plane, const Implicit& solid, double finest_px)
      : plane_(plane), solid_(solid), finest_px_(finest_px), pixel_mm_(plane.column_mm.norm()) {}

  // No point of the square is farther from its middle than half its diagonal. So where the distance there is longer,
  // the surface does not meet the square.
  void look_in(const Pixel& corner, double side_px) {
    const Pixel middle = corner + Pixel(0.5, 0.5) * side_px;
    if (std::abs(at(middle)) > 0.5 * std::sqrt(2.0) * side_px * pixel_mm_) return;
    if (side_px <= finest_px_) return draw(corner, side_px);
    const double half = 0.5 * side_px;
    for (const Pixel& part : {Pixel(0, 0), Pixel(half, 0), Pixel(0, half), Pixel(half, half)})
      look_in(corner + part, half);
  }
  std::vector<OutlinePart> take() { return std::move(parts_); }

 private:
  [[nodiscard]] double at(const Pixel& p) const { return solid_(plane_.at(p.x(), p.y())); }
  // Marching squares. The squares are small beside the solid, so two opposite corners are cut off each alone.
  void draw(const Pixel& corner, double side_px) {
    const std::array<Pixel, 4> p{corner, corner + Pixel(side_px, 0), corner + Pixel(side_px, side_px),
                                 corner + Pixel(0, side_px)};
    std::array<double, 4> d{};
    for (std::size_t i = 0; i < 4; ++i) d[i] = at(p[i]);
    std::vector<Pixel> crossings;
    for (std::size_t i = 0; i < 4; ++i) {
      const std::size_t next = (i + 1) % 4;
      if ((d[i] < 0.0) != (d[next] < 0.0)) crossings.push_back(crossing(p[i], p[next], d[i], d[next]));
    }
    for (std::size_t i = 0; i + 1 < crossings.size(); i += 2) parts_.push_back({crossings[i], crossings[i + 1]});
  }
  // By false position: the distance along an edge is nearly linear, but not quite.
  [[nodiscard]] Pixel crossing(Pixel a, Pixel b, double at_a, double at_b) const {
    Pixel found = a;
    for (int i = 0; i < 3; ++i) {
      found = a + at_a / (at_a - at_b) * (b - a);
      const double there = at(found);
      if (there == 0.0) break;
      if ((there < 0.0) == (at_a < 0.0))
        a = found, at_a = there;
      else
        b = found, at_b = there;
    }
    return found;
  }

  const PixelGrid& plane_;
  const Implicit& solid_;
  const double finest_px_, pixel_mm_;
  std::vector<OutlinePart> parts_;
};

// The part of a line from `at` along `way` that is in the image.
std::optional<std::pair<double, double>> clipped(const Pixel& at, const Pixel& way, const Pixel& last) {
  double from = -1e9, to = 1e9;
  for (Eigen::Index axis = 0; axis < 2; ++axis) {
    if (std::abs(way[axis]) < kNearlyParallel) {
      if (at[axis] < 0.0 || at[axis] > last[axis]) return {};
      continue;
    }
    const double a = -at[axis] / way[axis], b = (last[axis] - at[axis]) / way[axis];
    from = std::max(from, std::min(a, b));
    to = std::min(to, std::max(a, b));
  }
  if (from > to) return {};
  return std::pair(from, to);
}

}  // namespace

std::array<PixelGrid, kSlices> planes_of(const LinkedSlices& view) {
  std::array<PixelGrid, kSlices> planes;
  if (view.axes == SliceAxes::patient) {
    const auto named = radiology::patient_planes(view.point_mm, {view.pixel_mm, 1, 1});
    planes = {named.axial, named.coronal, named.sagittal};
  } else {
    const auto named = radiology::tool_planes({view.point_mm, view.rotation}, {view.pixel_mm, 1, 1});
    planes = {named.along, named.turned, named.across};
  }
  for (std::size_t i = 0; i < kSlices; ++i) {
    const Vec3 normal = normal_of(planes[i]);
    const Vec3 centre = view.centre_mm + normal * normal.dot(view.point_mm - view.centre_mm);
    planes[i] = radiology::grid_about(centre, right_of(planes[i]), down_of(planes[i]), view.pixel_mm,
                                      view.images[i].columns, view.images[i].rows);
  }
  return planes;
}

Vec3 normal_of(const PixelGrid& plane) { return right_of(plane).cross(down_of(plane)); }

Pixel pixel_at(const PixelGrid& plane, const Vec3& point_mm) {
  const Vec3 from_first = point_mm - plane.first_mm;
  return {from_first.dot(plane.column_mm) / plane.column_mm.squaredNorm(),
          from_first.dot(plane.row_mm) / plane.row_mm.squaredNorm()};
}

double depth_mm(const PixelGrid& plane, const Vec3& point_mm) {
  return normal_of(plane).dot(point_mm - plane.first_mm);
}

double scale_bar_mm(double most_mm) {
  OSTEON_CHECK(most_mm > 0.0);
  const double power = std::pow(10.0, std::floor(std::log10(most_mm)));
  for (const double step : {10.0, 5.0, 2.0})
    if (step * power <= most_mm) return step * power;
  return power;
}

std::vector<OutlinePart> outline_in(const PixelGrid& plane, const Implicit& solid, double finest_px) {
  // Squares from the one with the whole image to the finest, each half of the one before.
  double side_px = finest_px;
  while (side_px < std::max(plane.columns, plane.rows)) side_px *= 2.0;
  Outline outline(plane, solid, finest_px);
  outline.look_in(Pixel(-0.5, -0.5), side_px);
  return outline.take();
}

std::optional<ProjectedLine> project(const PixelGrid& plane, const Vec3& point_mm, const Vec3& direction) {
  const Pixel at = pixel_at(plane, point_mm), way = pixel_at(plane, point_mm + direction) - at;
  const Pixel last(plane.columns - 1, plane.rows - 1);
  const auto inside = [&](const Pixel& p) {
    return p.x() >= 0.0 && p.y() >= 0.0 && p.x() <= last.x() && p.y() <= last.y();
  };
  ProjectedLine line;
  const double steep = normal_of(plane).dot(direction);
  if (std::abs(steep) > kNearlyParallel) {
    const Pixel through = at - depth_mm(plane, point_mm) / steep * way;
    if (inside(through)) line.through = through;
  }
  if (way.norm() < kNearlyParallel) {  // it comes straight out of the image
    if (!line.through) return {};
    line.from = line.to = *line.through;
    return line;
  }
  const auto part = clipped(at, way, last);
  if (!part) return {};
  line.from = at + part->first * way;
  line.to = at + part->second * way;
  return line;
}

}  // namespace osteon
