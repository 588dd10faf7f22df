# Builds the cut kernel alone, as others may build it: by gcc and clang, unoptimised and optimised, with and without
# AVX. An object among a program's sources replaces the library's kernel at link time. All of them must give the same
# bytes.

# Sets `names` to the builds that this machine can make and run, and ${name}_object to the object of each. The objects
# belong to the calling folder.
function(osteon_kernel_builds names)
  set(made)
  if(NOT OSTEON_SANITIZE)
    get_target_property(eigen_headers Eigen3::Eigen INTERFACE_INCLUDE_DIRECTORIES)
    set(ways unoptimised plain)
    set(unoptimised -O0)
    set(plain -O2)
    set(avx2 -O3 -mavx2 -mfma)
    set(avx512 -O3 -mavx512f -mavx512vl -mavx512dq -mfma)
    foreach(feature avx2:avx2 avx512:avx512f)
      string(REPLACE ":" ";" feature ${feature})
      list(GET feature 0 way)
      list(GET feature 1 flag)
      file(STRINGS /proc/cpuinfo found REGEX "^flags.* ${flag}( |$)" LIMIT_COUNT 1)
      if(found)
        list(APPEND ways ${way})
      endif()
    endforeach()
    find_program(OSTEON_GXX NAMES g++)
    find_program(OSTEON_CLANGXX NAMES clang++)
    foreach(pair gcc:OSTEON_GXX clang:OSTEON_CLANGXX)
      string(REPLACE ":" ";" pair ${pair})
      list(GET pair 0 compiler)
      list(GET pair 1 path)
      if(NOT ${path})
        message(STATUS "no ${compiler}: the kernel is not tried with it")
        continue()
      endif()
      foreach(way ${ways})
        set(object ${CMAKE_CURRENT_BINARY_DIR}/kernel-${compiler}-${way}.o)
        add_custom_command(OUTPUT ${object}
          COMMAND ${${path}} -std=c++20 -ffp-contract=off ${${way}} -I${PROJECT_SOURCE_DIR} -isystem ${eigen_headers}
                  -MD -MF ${object}.d -c ${PROJECT_SOURCE_DIR}/common/field/kernel.cpp -o ${object}
          DEPENDS ${PROJECT_SOURCE_DIR}/common/field/kernel.cpp
          DEPFILE ${object}.d
          COMMENT "Building the kernel: ${compiler}-${way}")
        set_source_files_properties(${object} PROPERTIES EXTERNAL_OBJECT ON GENERATED ON)
        list(APPEND made ${compiler}-${way})
        set(${compiler}-${way}_object ${object} PARENT_SCOPE)
      endforeach()
    endforeach()
  endif()
  set(${names} ${made} PARENT_SCOPE)
endfunction()
