#include "viewer_client/render/status_text.hpp"

#include <vtkCoordinate.h>
#include <vtkNew.h>
#include <vtkRenderer.h>
#include <vtkTextActor.h>
#include <vtkTextProperty.h>

#include "viewer_client/render/lighting.hpp"

namespace osteon {

struct StatusText::Impl {
  vtkNew<vtkTextActor> gauges, notice;
};

StatusText::StatusText(vtkRenderer& renderer) : impl_(std::make_unique<Impl>()) {
  const auto add = [&](vtkTextActor* actor, int size, double r, double g, double b) {
    vtkTextProperty* text = actor->GetTextProperty();
    text->SetFontFamilyToArial();
    text->SetFontSize(size);
    text->SetColor(r, g, b);
    // Readable over bright bone too.
    text->SetBackgroundColor(kBackground[0], kBackground[1], kBackground[2]);
    text->SetBackgroundOpacity(0.55);
    actor->GetPositionCoordinate()->SetCoordinateSystemToNormalizedViewport();
    renderer.AddActor2D(actor);
  };
  add(impl_->gauges, 18, 0.93, 0.94, 0.95);
  impl_->gauges->SetPosition(0.016, 0.972);
  impl_->gauges->GetTextProperty()->SetVerticalJustificationToTop();
  impl_->gauges->GetTextProperty()->SetLineSpacing(1.25);
  add(impl_->notice, 15, 0.78, 0.82, 0.86);
  impl_->notice->SetPosition(0.016, 0.024);
}

StatusText::~StatusText() = default;

void StatusText::show(const std::string& gauges, const std::string& notice) {
  impl_->gauges->SetInput(gauges.c_str());
  impl_->notice->SetInput(notice.c_str());
  impl_->gauges->SetVisibility(gauges.empty() ? 0 : 1);
  impl_->notice->SetVisibility(notice.empty() ? 0 : 1);
}

}  // namespace osteon
