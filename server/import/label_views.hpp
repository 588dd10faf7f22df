// Pictures of labelled voxels: planes of the scan with the outlines of labels, and the labels' surface with shading.
#pragma once
#include <array>
#include <optional>
#include <span>
#include <vector>

#include "common/core/keep_going.hpp"
#include "common/geometry/lattice.hpp"
#include "common/volume/case_description.hpp"
#include "server/import/picture.hpp"

namespace osteon::import {

// Does not own its voxels: columns fastest, then rows, then slices.
struct LabelledVoxels {
  ScanGeometry geometry;
  std::span<const std::int16_t> hu;  // may be empty
  std::span<const std::uint8_t> labels;
};

// Of each label. A label without a colour is not drawn.
using LabelColours = std::array<std::optional<Colour>, 256>;

// A colour for the Nth of several bones or structures, from 0; after eight they begin again (Okabe 2008).
[[nodiscard]] Colour palette_colour(int index);

// The position in the patient (LPS) of everything with a colour; empty if there is nothing.
[[nodiscard]] Box coloured_box(const LabelledVoxels& voxels, const LabelColours& colours);

// A plane across the patient, or the side from which one looks at a surface. As radiologists look: a patient's right is
// on the left of axial and coronal planes, the front is on the left of sagittal ones, and the head is at the top.
enum class View { axial, coronal, sagittal };
// From the feet, from the front, and from the left.
[[nodiscard]] Vec3 direction_of(View view);

// A square picture of a part of the patient.
struct Frame {
  View view = View::axial;
  Vec3 centre_mm = Vec3::Zero();  // LPS
  double pixel_mm = 1.0;
  int pixels = 1;  // along an edge

  // The middle of a pixel, in the plane through the centre.
  [[nodiscard]] Vec3 position_mm(double x, double y) const;
  // The pixel of a position: x and y.
  [[nodiscard]] std::array<double, 2> pixel_of(const Vec3& position_mm) const;
};
// The frame around a box. `border`: pixels left free on every side.
[[nodiscard]] Frame frame_around(const Box& box, View view, int pixels, int border = 0);

// Writes the patient's sides at the edges of a picture of the frame, and a bar of known length: R and L for right and
// left, A and P for front and back, H and F for head and feet.
void write_sides(Picture& picture, const Frame& frame);

// Where the plane of a view meets most voxels with a colour, mm along x, y or z. Of these voxels a quarter lies before
// the plane and a quarter behind it, so that it does not graze the back of a skull.
[[nodiscard]] double fullest_plane_mm(const LabelledVoxels& voxels, const LabelColours& colours, View view);

// The plane of a frame, in the window for bone. Every label with a colour has its outline: the pixels of the label that
// are at most two pixels away, along x or y, from pixels of another one or of none. HU are interpolated linearly. The
// label is the one that the same weights of the eight voxels around give most.
[[nodiscard]] Picture draw_plane(const LabelledVoxels& voxels, const LabelColours& colours, const Frame& frame);

struct SurfacePicture {
  Picture picture;
  std::vector<std::uint8_t> labels;  // that each pixel shows; 0: none
};

// The surface of the labels with a colour, without perspective, lit from the upper left.
// `within`: labels with a colour in this list shine through the others. Error: cancelled.
[[nodiscard]] Result<SurfacePicture> draw_surface(const LabelledVoxels& voxels, const LabelColours& colours,
                                                  const LabelColours& within, const Frame& frame,
                                                  const KeepGoing& keep_going);

}  // namespace osteon::import
