#include "viewer_client/desktop/tool_icon.hpp"

#include <QColor>
#include <QImage>
#include <QPixmap>
#include <algorithm>
#include <cmath>

#include "common/tools/tool_solid.hpp"

namespace osteon {

namespace {

constexpr int kEdge_px = 72, kMargin_px = 5;
constexpr double kLongest = 4.0;  // of a tool's shown length, in widths; a longer shank is cut off

}  // namespace

QIcon tool_icon(const Tool& tool) {
  const Box box = local_bounds(tool);
  const Vec3 size = box.max_mm - box.min_mm;
  const double across = std::max(size.x(), 0.2 * size.z() / kLongest);
  // The part near the tip says what the tool is.
  const double shown =
      std::min(size.z(), std::max(kLongest * across, std::min(size.z(), 1.3 * tool.cutting_length_mm)));
  const double mm_per_px = std::max(shown, size.x()) / (kEdge_px - 2 * kMargin_px);
  const double below = box.max_mm.z(), middle = 0.5 * (box.min_mm.x() + box.max_mm.x());
  const double depth = 0.5 * (box.min_mm.y() + box.max_mm.y());

  const Implicit solid = tool_solid(tool);
  QImage image(kEdge_px, kEdge_px, QImage::Format_ARGB32);
  image.fill(Qt::transparent);
  for (int y = 0; y < kEdge_px; ++y)
    for (int x = 0; x < kEdge_px; ++x) {
      const double z = below - mm_per_px * (kEdge_px - kMargin_px - y);
      if (z < below - shown) continue;
      const Vec3 point(middle + mm_per_px * (x + 0.5 - 0.5 * kEdge_px), depth, z);
      const double distance = solid(point) / mm_per_px;
      if (distance > 0.5) continue;
      // The surface's slope in the picture shades it, as if it were round.
      const double side = std::clamp(0.5 - distance, 0.0, 1.0);
      const double light = 0.72 + 0.28 * std::clamp(-distance / 8.0, 0.0, 1.0);
      const bool cutting = tool.cuts() && z > below - tool.cutting_length_mm;
      const QColor colour = cutting ? QColor(214, 158, 46) : QColor(120, 136, 156);
      image.setPixelColor(x, y,
                          QColor(static_cast<int>(light * colour.red()), static_cast<int>(light * colour.green()),
                                 static_cast<int>(light * colour.blue()), static_cast<int>(255 * side)));
    }
  return QIcon(QPixmap::fromImage(image));
}

}  // namespace osteon
