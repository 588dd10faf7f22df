#include "tests/perf/baselines/itk_flood.hpp"

#include <itkConnectedThresholdImageFilter.h>
#include <itkImage.h>
#include <itkImportImageFilter.h>
#include <itkMultiThreaderBase.h>

#include <ctime>

namespace osteon::test {

ItkFlood itk_flood(const std::array<int, 3>& dims, std::span<const std::int16_t> hu, const std::array<int, 3>& seed,
                   std::int16_t low_hu, std::int16_t high_hu) {
  using Scan = itk::Image<std::int16_t, 3>;
  using Mask = itk::Image<std::uint8_t, 3>;
  itk::MultiThreaderBase::SetGlobalDefaultNumberOfThreads(1);
  auto importer = itk::ImportImageFilter<std::int16_t, 3>::New();
  Scan::RegionType region;
  for (unsigned axis = 0; axis < 3; ++axis) region.SetSize(axis, static_cast<itk::SizeValueType>(dims[axis]));
  importer->SetRegion(region);
  importer->SetImportPointer(const_cast<std::int16_t*>(hu.data()), hu.size(), false);
  importer->Update();

  auto filter = itk::ConnectedThresholdImageFilter<Scan, Mask>::New();
  filter->SetInput(importer->GetOutput());
  filter->SetSeed({{seed[0], seed[1], seed[2]}});
  filter->SetLower(low_hu);
  filter->SetUpper(high_hu);
  filter->SetReplaceValue(1);
  const std::clock_t start = std::clock();
  filter->Update();
  ItkFlood flood;
  flood.ms = 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  const std::uint8_t* mask = filter->GetOutput()->GetBufferPointer();
  flood.mask.assign(mask, mask + hu.size());
  return flood;
}

}  // namespace osteon::test
