// Draws what is planned and the structures at risk. All functions: [render], the thread that opened the window.
#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "common/surface/surgical_plan.hpp"
#include "viewer_client/render/layer_above.hpp"

class vtkRenderWindow;

namespace osteon {

// Red, green, blue, 8 bits each. Colours of Okabe and Ito 2008, which people with any colour vision tell apart.
[[nodiscard]] std::uint32_t colour_of(StructureKind kind);

class PlanActors {
 public:
  // `bone`: the pictures of the bone, which hides what is behind it. All must outlive it.
  PlanActors(const BonePictures& bone, vtkRenderWindow& window);
  ~PlanActors();

  void show(const SurgicalPlan& plan);
  // How names are written from the next plan on, UTF-8; at first as they are.
  void name_axes(std::function<std::string(const std::string&)> written);
  // Both are off at first.
  void set_planned(bool on);
  void set_risks(bool on);
  // Gives lines their width on the screen. Call this before each picture. `two_pictures`: the window has two pictures
  // side by side.
  void place(bool two_pictures);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon
