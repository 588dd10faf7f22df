#include "viewer_client/render/actors.hpp"

#include <vtkActor.h>
#include <vtkCellArray.h>
#include <vtkFloatArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkSmartPointer.h>
#include <vtkTypeInt32Array.h>
#include <vtkUnsignedCharArray.h>

#include <cstring>
#include <vector>

namespace osteon {

namespace {

vtkSmartPointer<vtkFloatArray> vectors(std::span<const std::array<float, 3>> from) {
  auto to = vtkSmartPointer<vtkFloatArray>::New();
  to->SetNumberOfComponents(3);
  to->SetNumberOfTuples(static_cast<vtkIdType>(from.size()));
  if (!from.empty()) std::memcpy(to->GetPointer(0), from.data(), from.size_bytes());
  return to;
}

vtkSmartPointer<vtkCellArray> cells_of(std::span<const std::array<std::uint32_t, 3>> triangles) {
  // 32-bit connectivity is a copy of our own array. Offsets of triangles are multiples of three.
  vtkNew<vtkTypeInt32Array> corners, offsets;
  corners->SetNumberOfValues(static_cast<vtkIdType>(3 * triangles.size()));
  if (!triangles.empty()) std::memcpy(corners->GetPointer(0), triangles.data(), triangles.size_bytes());
  offsets->SetNumberOfValues(static_cast<vtkIdType>(triangles.size() + 1));
  for (std::size_t i = 0; i <= triangles.size(); ++i) {
    offsets->SetValue(static_cast<vtkIdType>(i), static_cast<vtkTypeInt32>(3 * i));
  }
  auto cells = vtkSmartPointer<vtkCellArray>::New();
  cells->SetData(offsets, corners);
  return cells;
}

}  // namespace

vtkSmartPointer<vtkPolyData> poly_data(std::span<const std::array<float, 3>> positions_mm,
                                       std::span<const std::array<float, 3>> normals,
                                       std::span<const std::uint8_t> marked,
                                       std::span<const std::array<std::uint32_t, 3>> triangles,
                                       std::span<const Colour> palette) {
  std::vector<Colour> colours(marked.size());
  for (std::size_t i = 0; i < marked.size(); ++i) colours[i] = palette[marked[i]];
  return poly_data(positions_mm, normals, colours, triangles);
}

vtkSmartPointer<vtkPolyData> poly_data(std::span<const std::array<float, 3>> positions_mm,
                                       std::span<const std::array<float, 3>> normals, std::span<const Colour> colours,
                                       std::span<const std::array<std::uint32_t, 3>> triangles) {
  vtkNew<vtkPoints> points;
  points->SetData(vectors(positions_mm));

  vtkNew<vtkUnsignedCharArray> bytes;
  bytes->SetNumberOfComponents(3);
  bytes->SetNumberOfTuples(static_cast<vtkIdType>(colours.size()));
  if (!colours.empty()) std::memcpy(bytes->GetPointer(0), colours.data(), 3 * colours.size());

  auto data = vtkSmartPointer<vtkPolyData>::New();
  data->SetPoints(points);
  data->SetPolys(cells_of(triangles));
  data->GetPointData()->SetNormals(vectors(normals));
  data->GetPointData()->SetScalars(bytes);
  return data;
}

vtkSmartPointer<vtkActor> actor_of(vtkPolyData* data) {
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputData(data);
  auto actor = vtkSmartPointer<vtkActor>::New();
  actor->SetMapper(mapper);
  return actor;
}

vtkSmartPointer<vtkActor> bone_actor(vtkPolyData* data) {
  auto actor = actor_of(data);
  vtkProperty* bone = actor->GetProperty();
  bone->SetInterpolationToPhong();
  bone->SetAmbient(0.10);
  bone->SetDiffuse(0.88);
  bone->SetSpecular(0.13);
  bone->SetSpecularPower(22.0);
  // A closed surface hides its back faces. Not drawing them saves a third of a frame in software.
  bone->SetBackfaceCulling(1);
  return actor;
}

}  // namespace osteon
