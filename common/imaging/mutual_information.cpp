#include "common/imaging/mutual_information.hpp"

#include <itkCommand.h>
#include <itkEuler3DTransform.h>
#include <itkImage.h>
#include <itkMattesMutualInformationImageToImageMetricv4.h>
#include <itkPointSet.h>
#include <itkRegularStepGradientDescentOptimizerv4.h>

#include <new>
#include <string>
#include <utility>

namespace osteon::imaging {
namespace {

using Image = itk::Image<float, 3>;
using MattesMetric = itk::MattesMutualInformationImageToImageMetricv4<Image, Image>;
using Motion = itk::Euler3DTransform<double>;
using Optimizer = itk::RegularStepGradientDescentOptimizerv4<double>;
using SamplePoints = MattesMetric::FixedSampledPointSetType;

constexpr unsigned kBins = 40;
constexpr double kLeastStep = 1e-3;  // of the first one
constexpr double kShorter = 0.8;     // factor of the step where the direction turns back

// On one thread: sums of rounded numbers depend on how threads share them. The metric's own limit bounds the threads,
// but not the parts into which it splits its sums.
class Metric : public MattesMetric {
 public:
  using Self = Metric;
  using Pointer = itk::SmartPointer<Self>;
  itkSimpleNewMacro(Self);

 protected:
  Metric() {
    m_SparseGetValueAndDerivativeThreader->SetNumberOfWorkUnits(1);
    m_DenseGetValueAndDerivativeThreader->SetNumberOfWorkUnits(1);
  }
};

// An image of ITK on the same memory.
Image::Pointer image_of(const GreyImage& grey) {
  const auto image = Image::New();
  Image::SizeType size;
  Image::SpacingType spacing;
  Image::PointType origin;
  Image::DirectionType direction;
  std::size_t count = 1;
  for (unsigned axis = 0; axis < 3; ++axis) {
    size[axis] = static_cast<itk::SizeValueType>(grey.dims[axis]);
    count *= size[axis];
    spacing[axis] = grey.spacing_mm[axis];
    origin[axis] = grey.origin_mm[axis];
    for (unsigned row = 0; row < 3; ++row) direction[row][axis] = grey.axes[axis][row];
  }
  image->SetRegions(size);
  image->SetSpacing(spacing);
  image->SetOrigin(origin);
  image->SetDirection(direction);
  image->GetPixelContainer()->SetImportPointer(grey.values, count, false);
  return image;
}

// Calls `work`, and turns what ITK throws into an error.
template <class Work>
auto without_exceptions(Work work) -> decltype(work()) try {
  return work();
} catch (const itk::MemoryAllocationError&) {
  return failure(ErrorCode::exhausted, "this machine has no memory to register the scans; export smaller regions");
} catch (const std::bad_alloc&) {
  return failure(ErrorCode::exhausted, "this machine has no memory to register the scans; export smaller regions");
} catch (const itk::ExceptionObject& fault) {
  return failure(ErrorCode::internal, std::string("ITK cannot register the scans: ") + fault.GetDescription());
}

}  // namespace

struct MutualInformation::Impl {
  Metric::Pointer metric = Metric::New();
  Motion::Pointer motion = Motion::New();
};

MutualInformation::MutualInformation(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
MutualInformation::MutualInformation(MutualInformation&&) noexcept = default;
MutualInformation::~MutualInformation() = default;

Result<MutualInformation> MutualInformation::between(const GreyImage& fixed, const GreyImage& moving,
                                                     const std::vector<std::array<float, 3>>& points_mm,
                                                     const std::array<double, 3>& centre_mm) {
  return without_exceptions([&]() -> Result<MutualInformation> {
    itk::Object::SetGlobalWarningDisplay(false);  // ITK would write of points beyond an image to standard error
    auto impl = std::make_unique<Impl>();
    const auto points = SamplePoints::New();
    for (std::size_t i = 0; i < points_mm.size(); ++i) {
      SamplePoints::PointType point;
      for (unsigned axis = 0; axis < 3; ++axis) point[axis] = points_mm[i][axis];
      points->SetPoint(i, point);
    }
    Motion::InputPointType centre;
    for (unsigned axis = 0; axis < 3; ++axis) centre[axis] = centre_mm[axis];
    impl->motion->SetIdentity();
    impl->motion->SetCenter(centre);
    Metric& metric = *impl->metric;
    metric.SetFixedImage(image_of(fixed));
    metric.SetMovingImage(image_of(moving));
    metric.SetMovingTransform(impl->motion);
    metric.SetNumberOfHistogramBins(kBins);
    metric.SetFixedSampledPointSet(points);
    metric.SetUseSampledPointSet(true);
    // Differences beside a point, instead of a filtered copy of the whole image.
    metric.SetUseMovingImageGradientFilter(false);
    metric.SetUseFixedImageGradientFilter(false);
    metric.Initialize();
    return MutualInformation(std::move(impl));
  });
}

Result<double> MutualInformation::value() const {
  return without_exceptions([&]() -> Result<double> { return -impl_->metric->GetValue(); });
}

Result<RigidMotion> MutualInformation::search(double step_mm, double radius_mm, std::size_t most_iterations,
                                              const KeepGoing& keep_going) {
  return without_exceptions([&]() -> Result<RigidMotion> {
    if (!keep_going(0.0)) return stopped_while("registering the scans");
    Optimizer::ScalesType scales(Motion::ParametersDimension);
    for (unsigned i = 0; i < scales.size(); ++i) scales[i] = i < 3 ? radius_mm * radius_mm : 1.0;
    const auto optimizer = Optimizer::New();
    optimizer->SetMetric(impl_->metric);
    optimizer->SetScales(scales);
    optimizer->SetNumberOfIterations(most_iterations);
    optimizer->SetLearningRate(step_mm);
    optimizer->SetMinimumStepLength(kLeastStep * step_mm);
    optimizer->SetRelaxationFactor(kShorter);
    optimizer->SetGradientMagnitudeTolerance(1e-9);  // the step alone ends the search
    optimizer->SetNumberOfWorkUnits(1);
    bool stopped = false;
    optimizer->AddObserver(itk::IterationEvent(), [&](const itk::EventObject&) {
      const auto done = static_cast<double>(optimizer->GetCurrentIteration());
      if (keep_going(done / static_cast<double>(most_iterations))) return;
      stopped = true;
      optimizer->StopOptimization();
    });
    optimizer->StartOptimization();
    if (stopped) return stopped_while("registering the scans");
    RigidMotion found;
    for (unsigned row = 0; row < 3; ++row) {
      found.offset_mm[row] = impl_->motion->GetOffset()[row];
      for (unsigned column = 0; column < 3; ++column)
        found.rotation[row][column] = impl_->motion->GetMatrix()[row][column];
    }
    return found;
  });
}

}  // namespace osteon::imaging
