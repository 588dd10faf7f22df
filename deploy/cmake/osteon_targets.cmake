# Declares every Osteon target in one way: one library per folder, sources listed, headers in a FILE_SET.
#
#   osteon_library(tools SOURCES drill.cpp HEADERS drill.hpp DEPS osteon::geometry)
#   osteon_program(osteon-server PACKAGE osteon-server SOURCES main.cpp DEPS osteon::room)
#   osteon_test(unit.field SOURCES kernel_test.cpp DEPS osteon::field)

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
# Lets tests/architecture compile every header alone. Not part of the normal build.
set(CMAKE_VERIFY_INTERFACE_HEADER_SETS ON)
# All programs and tests of a build are in one folder, so that they find each other wherever the build is.
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/bin)

set(OSTEON_SANITIZE "" CACHE STRING "Sanitizers to build with, as given to -fsanitize=")
option(OSTEON_CHECK_LOCK_ORDER "Abort when a thread takes locks in another order than LockRank's" OFF)

add_library(osteon_flags INTERFACE)
# Contraction is off everywhere: the same source gives the same numbers on every compiler and processor.
target_compile_options(osteon_flags INTERFACE -Wall -Wextra -Wshadow -Wnon-virtual-dtor -ffp-contract=off)
target_include_directories(osteon_flags INTERFACE ${PROJECT_SOURCE_DIR})
# A guarded member that is used without its lock is an error. Only clang can tell.
if(CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
  target_compile_options(osteon_flags INTERFACE -Wthread-safety -Werror=thread-safety)
endif()
# Unity files fill GCC's memory again and again, and each search for garbage takes time. From 512 MB on it searches.
add_compile_options($<$<AND:$<COMPILE_LANGUAGE:CXX>,$<CXX_COMPILER_ID:GNU>>:--param=ggc-min-heapsize=524288>)
if(OSTEON_CHECK_LOCK_ORDER)
  target_compile_definitions(osteon_flags INTERFACE OSTEON_CHECK_LOCK_ORDER)
endif()
# lld links in less than half of the time of gold, and gold in a third of the time of GNU ld.
include(CheckLinkerFlag)
foreach(linker lld gold)
  check_linker_flag(CXX -fuse-ld=${linker} OSTEON_HAS_${linker})
  if(OSTEON_HAS_${linker})
    target_link_options(osteon_flags INTERFACE -fuse-ld=${linker})
    break()
  endif()
endforeach()
if(OSTEON_SANITIZE)
  target_compile_options(osteon_flags INTERFACE -fsanitize=${OSTEON_SANITIZE} -fno-omit-frame-pointer)
  target_link_options(osteon_flags INTERFACE -fsanitize=${OSTEON_SANITIZE})
endif()

# What tests do themselves is short, so it is optimised less: that takes a quarter off their compilation.
add_library(osteon_test_flags INTERFACE)
target_compile_options(osteon_test_flags INTERFACE $<$<CONFIG:RelWithDebInfo>:-O1>)

function(osteon_library name)
  cmake_parse_arguments(arg "" "" "SOURCES;HEADERS;DEPS;PRIVATE_DEPS" ${ARGN})
  set(target osteon_${name})
  if(arg_SOURCES)
    add_library(${target} STATIC ${arg_SOURCES})
    set(scope PUBLIC)
    target_link_libraries(${target} PRIVATE ${arg_PRIVATE_DEPS})
  else()
    add_library(${target} INTERFACE)
    set(scope INTERFACE)
  endif()
  add_library(osteon::${name} ALIAS ${target})
  target_sources(${target} ${scope} FILE_SET HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR} FILES ${arg_HEADERS})
  target_link_libraries(${target} ${scope} osteon_flags ${arg_DEPS})
endfunction()

# PACKAGE: the component of `cmake --install` and the Debian package. Programs without one are not installed.
function(osteon_program name)
  cmake_parse_arguments(arg "" "PACKAGE" "SOURCES;DEPS" ${ARGN})
  add_executable(${name} ${arg_SOURCES})
  target_link_libraries(${name} PRIVATE osteon_flags ${arg_DEPS})
  if(arg_PACKAGE)
    osteon_install_program(${name} ${arg_PACKAGE})
  endif()
endfunction()

# Headers that most tests include, compiled once for all of them. Tests still include all that they use, because the
# preset `lint` compiles without this, and so does clang. QT: a test of the window. Qt wants other code (`-fPIC`), for
# which GCC refuses the other tests' compiled headers, and these tests include Qt's headers too.
function(osteon_precompile_test target)
  cmake_parse_arguments(arg "QT" "" "" ${ARGN})
  if(NOT CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    return()
  endif()
  set(name osteon_test_headers)
  set(headers <algorithm> <array> <chrono> <filesystem> <functional> <map> <memory> <mutex> <optional> <random>
    <sstream> <string> <thread> <variant> <vector> <Eigen/Core> <Eigen/Geometry> <gmock/gmock.h> <gtest/gtest.h>
    <tl/expected.hpp>)
  set(libraries)
  if(arg_QT)
    set(name osteon_window_test_headers)
    list(APPEND headers <QApplication> <QComboBox> <QDockWidget> <QListWidget> <QMainWindow> <QMenu> <QPushButton>
      <QSettings> <QSlider> <QSpinBox> <QStatusBar> <QTest> <QToolButton>)
    set(libraries Qt5::Test Qt5::Widgets)
    # A guide has slots, and so does Qt.
    target_compile_definitions(${target} PRIVATE QT_NO_KEYWORDS)
  endif()
  if(NOT TARGET ${name})
    # A target needs a file. This one is empty.
    file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/${name}.cpp CONTENT "")
    add_library(${name} OBJECT ${PROJECT_BINARY_DIR}/${name}.cpp)
    target_link_libraries(${name} PRIVATE
      osteon_flags osteon_test_flags Eigen3::Eigen tl::expected GTest::gmock ${libraries})
    target_precompile_headers(${name} PRIVATE ${headers})
    target_compile_definitions(${name} PRIVATE $<$<BOOL:${arg_QT}>:QT_NO_KEYWORDS>)
  endif()
  target_precompile_headers(${target} REUSE_FROM ${name})
  # ccache needs the option, to see that a file includes the headers. Compiled headers that GCC refuses end the build,
  # which else only becomes slower.
  target_compile_options(${target} PRIVATE -fpch-preprocess -Werror=invalid-pch)
endfunction()

# What a program of tests says if its filter matches no case. It ends with 0 then, but the entry of ctest fails.
set(OSTEON_NO_CASE "Running 0 tests from")

# Sets `suites` to the suites of GoogleTest in the files. A change of a file makes CMake look again.
function(osteon_test_suites suites)
  set(found)
  foreach(file IN LISTS ARGN)
    if(file MATCHES "_test\\.cpp$")
      set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
      file(STRINGS ${file} cases REGEX "^TEST(_F|_P)?\\(")
      list(TRANSFORM cases REPLACE "^TEST[_FP]*\\(([A-Za-z0-9_]+),.*" "\\1")
      list(APPEND found ${cases})
    endif()
  endforeach()
  list(REMOVE_DUPLICATES found)
  set(${suites} ${found} PARENT_SCOPE)
endfunction()

# A GoogleTest program. Each of its suites is registered with ctest: a process for each case would take longer to load
# libraries than to test. LABELS name the kind of test. deploy/nightly builds NIGHTLY tests with the target
# nightly_tests and runs them with `ctest -C nightly`. deploy/test neither builds nor runs them. QT: as above.
function(osteon_test name)
  cmake_parse_arguments(arg "NIGHTLY;QT" "TIMEOUT" "SOURCES;DEPS;LABELS" ${ARGN})
  add_executable(${name} ${arg_SOURCES})
  set(only)
  if(arg_NIGHTLY)
    set_target_properties(${name} PROPERTIES EXCLUDE_FROM_ALL ON)
    add_dependencies(nightly_tests ${name})
    set(only CONFIGURATIONS nightly)
  endif()
  target_link_libraries(${name} PRIVATE osteon_flags osteon_test_flags ${arg_DEPS} GTest::gmock_main)
  set(qt)
  if(arg_QT)
    set(qt QT)
  endif()
  osteon_precompile_test(${name} ${qt})
  if(NOT arg_TIMEOUT)
    # Ends a test that hangs. A busy machine makes tests ten times as slow.
    set(arg_TIMEOUT 300)
  endif()
  # Under a sanitizer tests take several times as long.
  if(OSTEON_SANITIZE)
    math(EXPR arg_TIMEOUT "${arg_TIMEOUT} * 5")
  endif()
  osteon_test_suites(suites ${arg_SOURCES})
  set(tests)
  foreach(suite IN LISTS suites)
    add_test(NAME ${name}.${suite} COMMAND ${name} --gtest_filter=${suite}.*:*/${suite}.* ${only})
    list(APPEND tests ${name}.${suite})
  endforeach()
  # A program of objects that another target compiled.
  if(NOT tests)
    add_test(NAME ${name} COMMAND ${name} ${only})
    set(tests ${name})
  endif()
  set_tests_properties(${tests} PROPERTIES
    TIMEOUT ${arg_TIMEOUT} LABELS "${arg_LABELS}" FAIL_REGULAR_EXPRESSION "${OSTEON_NO_CASE}")
endfunction()
