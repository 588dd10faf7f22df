// Two texts in the picture's corners: gauges above, a notice below. All functions: [render], the thread that opened the
// window.
#pragma once
#include <memory>
#include <string>

class vtkRenderer;

namespace osteon {

class StatusText {
 public:
  // The renderer must outlive it.
  explicit StatusText(vtkRenderer& renderer);
  ~StatusText();

  // Empty: nothing.
  void show(const std::string& gauges, const std::string& notice);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon
