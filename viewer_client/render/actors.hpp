// Makes VTK's data and actors from our meshes. All functions: [render], the thread that opened the window.
#pragma once
#include <array>
#include <cstdint>
#include <span>

class vtkActor;
class vtkPolyData;
template <class T>
class vtkSmartPointer;

namespace osteon {

using Colour = std::array<std::uint8_t, 3>;  // red, green, blue

// Copies triangles. `normals` and `marked` have one value for each position; `marked` selects its colour in `palette`.
[[nodiscard]] vtkSmartPointer<vtkPolyData> poly_data(std::span<const std::array<float, 3>> positions_mm,
                                                     std::span<const std::array<float, 3>> normals,
                                                     std::span<const std::uint8_t> marked,
                                                     std::span<const std::array<std::uint32_t, 3>> triangles,
                                                     std::span<const Colour> palette);

// The same with a colour for each position.
[[nodiscard]] vtkSmartPointer<vtkPolyData> poly_data(std::span<const std::array<float, 3>> positions_mm,
                                                     std::span<const std::array<float, 3>> normals,
                                                     std::span<const Colour> colours,
                                                     std::span<const std::array<std::uint32_t, 3>> triangles);

[[nodiscard]] vtkSmartPointer<vtkActor> actor_of(vtkPolyData* data);
// The closed surface of a bone in the light.
[[nodiscard]] vtkSmartPointer<vtkActor> bone_actor(vtkPolyData* data);

}  // namespace osteon
