// How many threads VTK's filters may use.
#pragma once

namespace osteon::test {

// From now on; the name of what runs them.
const char* vtk_threads(int count);

}  // namespace osteon::test
