// Baseline of the surface: VTK's flying edges on samples that are ready in one dense image. Osteon gathers its samples
// itself, from a sparse field, in the time that is measured.
#pragma once
#include <vtkFlyingEdges3D.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPolyData.h>

#include <span>

#include "common/geometry/lattice.hpp"

namespace osteon {
class CutField;
}

namespace osteon::baselines {

// On a cell's face with two solid corners across from each other, marching cubes has to choose. Osteon keeps the solid
// corners apart. VTK keeps apart the corners at or above the isovalue.
enum class Inside {
  above,  // of -f, with an isovalue just above 0: VTK keeps the bone apart, and f = 0 is air, as in Osteon
  below,  // of f at 0: VTK keeps the air apart
};

// An image of f in a box of samples of the level, in VTK's layout: its x is the bone's z.
void fill_image(vtkImageData& image, const CutField& field, int level, const CoordBox& box,
                Inside inside = Inside::above);

// The contour with normals. Uses the threads of vtk_threads().
class FlyingEdges {
 public:
  explicit FlyingEdges(vtkImageData* image, Inside inside = Inside::above);
  void run();
  [[nodiscard]] long long triangles();
  [[nodiscard]] vtkPolyData& surface() { return *filter_->GetOutput(); }

 private:
  vtkNew<vtkFlyingEdges3D> filter_;
};

// Samples of the cuts' level that a frame of cuts may have changed, and the cells round them: all that has to be made
// anew.
[[nodiscard]] CoordBox crop_of(std::span<const Coord> changed_leaves);

}  // namespace osteon::baselines
