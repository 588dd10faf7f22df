// Compiled as C++17: VTK 9.1's header of its thread pool is not C++20.
#include "tests/perf/vtk_threads.hpp"

#include <vtkSMPTools.h>

namespace osteon::test {

const char* vtk_threads(int count) {
  vtkSMPTools::SetBackend(count == 1 ? "Sequential" : "STDThread");
  vtkSMPTools::Initialize(count);
  return vtkSMPTools::GetBackend();
}

}  // namespace osteon::test
