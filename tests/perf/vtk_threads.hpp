// How many threads VTK's filters may use.
#pragma once

namespace osteon::test {

// Sets the number from now on. Returns the name of VTK's thread backend.
const char* vtk_threads(int count);

}  // namespace osteon::test
