// Makes the samples of a case from its scan, one part at a time.
#pragma once
#include <bitset>
#include <cstdint>
#include <span>
#include <vector>

#include "common/imaging/calibration.hpp"
#include "common/imaging/hu_volume.hpp"
#include "common/volume/case.hpp"
#include "common/volume/case_scan.hpp"
#include "common/volume/sparse_volume.hpp"

namespace osteon::import {

// What the samples are made from. Everything must outlive the CaseSamples.
struct SampleSource {
  const imaging::HuVolume& scan;     // geometry of the whole scan, at whose ends the bone ends
  const imaging::HuVolume& volume;   // geometry of the part to which the boxes refer
  imaging::VoxelBox hu_box;          // contains imaging::voxels_for() all samples
  std::span<const std::int16_t> hu;  // of hu_box
  imaging::VoxelBox kept_box;        // contains every voxel of bone
  const CaseScan& kept;              // labels and tissues of kept_box
  std::bitset<256> bone_labels;      // which labels are bone
  std::bitset<256> tissue_labels;    // which of these say the tissue, too
  bool several = false;              // samples get the numbers of their bones
  bool known_tissue = false;         // there is metal, enamel, or a label that says the tissue
  DensityCalibration calibration;
  const SparseVolume* change_hu = nullptr;  // added to the HU of samples
};

// Density and labels are computed only where bone is in or near a leaf.
class CaseSamples {
 public:
  // `surface_mm`: loses the leaves that were read, because every part is filled only once.
  CaseSamples(const SampleSource& source, SparseVolume& surface_mm, double pitch_mm);

  PartKind fill(const CoordBox& part, PartSamples& to);

 private:
  void fill_leaf(Coord origin, const CoordBox& part, PartSamples& to);
  [[nodiscard]] std::ptrdiff_t label_voxel(const Vec3& position_mm) const;

  SampleSource from_;
  SparseVolume& surface_mm_;
  double pitch_mm_;
  float band_;
  std::vector<float> hu_, change_hu_;
};

}  // namespace osteon::import
