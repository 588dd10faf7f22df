// Collision of a tool's sample points with bone, in two ways: on segmentation cells (Niu 2008, §7.2), and by the
// distance field. Segmentation cells only know whether a sample is bone (1) or not (0).
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/tools/tool.hpp"
#include "common/volume/cut_field.hpp"

namespace osteon {

// How to decide in a cell with both kinds of samples.
enum class MixedCell : std::uint8_t {
  nearest,    // the sample nearest to the point: wrong by up to half a cell diagonal
  trilinear,  // all eight samples, weighted by nearness, compared with one half
};

// The segmentation of a box of samples of one level, as codes of its cells. A code has one bit for each corner, so one
// byte tells whether a cell is all bone or all empty.
class BoneCells {
 public:
  BoneCells(const CutField& field, int level, const CoordBox& samples);
  // Called after cuts. Computes the cells of the box that lie in `changed` again.
  void update(const CutField& field, const CoordBox& changed);

  // Whether the point is on or in the bone. Always false outside the box, where there are no cells.
  [[nodiscard]] bool inside(const Vec3& point_mm, MixedCell rule) const;
  [[nodiscard]] std::size_t memory_bytes() const { return codes_.size(); }

 private:
  int level_;
  double pitch_mm_;
  CoordBox samples_;
  Coord cells_;                      // along each axis
  std::vector<std::uint8_t> codes_;  // bit 4x + 2y + z: the sample at that corner is bone
};

// The distance field of a box of samples, trilinear between them. It answers the same question by distances.
class BoneDistance {
 public:
  BoneDistance(const CutField& field, int level, const CoordBox& samples);
  [[nodiscard]] double distance_mm(const Vec3& point_mm) const;  // outside the box: a large distance
  [[nodiscard]] bool inside(const Vec3& point_mm) const { return distance_mm(point_mm) <= 0.0; }
  [[nodiscard]] std::size_t memory_bytes() const { return values_.size() * sizeof(float); }

 private:
  double pitch_mm_;
  CoordBox samples_;
  Coord dims_;
  std::vector<float> values_;
};

// The first of a tool's points that is on or in the bone, as in Niu 2008, §7.2. Nothing if the tool is free.
[[nodiscard]] std::optional<std::size_t> first_contact(const BoneCells& bone, MixedCell rule,
                                                       std::span<const SamplePoint> points, const Pose& pose_bone_tool);
[[nodiscard]] std::optional<std::size_t> first_contact(const BoneDistance& bone, std::span<const SamplePoint> points,
                                                       const Pose& pose_bone_tool);

}  // namespace osteon
