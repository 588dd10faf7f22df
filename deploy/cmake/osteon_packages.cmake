# Finds the packages of deploy/packages.txt, and gives each library one target name.

find_package(PkgConfig REQUIRED)
find_package(Threads REQUIRED)
find_package(absl REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(Protobuf REQUIRED)
find_package(tl-expected REQUIRED)
find_package(spdlog REQUIRED)
find_package(CLI11 REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(LibArchive REQUIRED)
find_package(pugixml REQUIRED)
find_package(yaml-cpp REQUIRED)
find_package(GDCM REQUIRED)
find_package(ITK 5.2 REQUIRED COMPONENTS
  ITKIOGDCM ITKIOMeta ITKIONIFTI ITKIONRRD ITKLabelMap ITKOptimizersv4 ITKRegionGrowing ITKSmoothing ITKTransform)
# Its targets name no folder of headers.
find_path(OSTEON_ITK_HEADERS itkNiftiImageIO.h PATH_SUFFIXES ITK-5.2 REQUIRED)
# Lets the files of a target include ITK, with GCC and with clang.
function(osteon_include_itk target)
  target_include_directories(${target} SYSTEM PRIVATE ${OSTEON_ITK_HEADERS})
  target_compile_options(${target} PRIVATE "SHELL:-include ${PROJECT_SOURCE_DIR}/deploy/cmake/itk_with_clang.h")
endfunction()
find_package(Qt5 5.15 REQUIRED COMPONENTS Widgets LinguistTools)
find_package(PNG REQUIRED)
find_package(ZLIB REQUIRED)
find_package(OpenSSL REQUIRED)
find_package(prometheus-cpp REQUIRED)
find_package(VTK 9.1 REQUIRED COMPONENTS
  CommonCore CommonDataModel FiltersCore FiltersSources FiltersGeneral IOImage ImagingCore
  GUISupportQt InteractionStyle RenderingCore RenderingOpenGL2 RenderingFreeType RenderingAnnotation
  RenderingVolume RenderingVolumeOpenGL2)

pkg_check_modules(grpc REQUIRED IMPORTED_TARGET grpc++)
pkg_check_modules(microhttpd REQUIRED IMPORTED_TARGET libmicrohttpd)
pkg_check_modules(sodium REQUIRED IMPORTED_TARGET libsodium)
pkg_check_modules(sqlite REQUIRED IMPORTED_TARGET sqlite3)
pkg_check_modules(hdf5 REQUIRED IMPORTED_TARGET hdf5-serial)
pkg_check_modules(usb REQUIRED IMPORTED_TARGET libusb-1.0)
pkg_check_modules(hidapi REQUIRED IMPORTED_TARGET hidapi-hidraw)
pkg_check_modules(sdl2 REQUIRED IMPORTED_TARGET sdl2)
pkg_check_modules(rtaudio REQUIRED IMPORTED_TARGET rtaudio)
pkg_check_modules(mysofa REQUIRED IMPORTED_TARGET libmysofa)
pkg_check_modules(pulse REQUIRED IMPORTED_TARGET libpulse)
pkg_check_modules(sndfile REQUIRED IMPORTED_TARGET sndfile)
pkg_check_modules(kissfft REQUIRED IMPORTED_TARGET kissfft-float)
pkg_check_modules(samplerate REQUIRED IMPORTED_TARGET samplerate)

# Debian's OpenVDB has its find module beside the library instead of a package file.
list(APPEND CMAKE_MODULE_PATH /usr/lib/${CMAKE_LIBRARY_ARCHITECTURE}/cmake/OpenVDB)
find_package(OpenVDB 10 REQUIRED)
# The loader looks for each of OpenVDB's 69 000 names in one library after the other, in the order of linking. So
# OpenVDB comes first, except in a build with a sanitizer, whose own library must come first.
if(NOT OSTEON_SANITIZE)
  target_link_options(osteon_flags INTERFACE
    "SHELL:-Wl,--push-state,--as-needed $<TARGET_FILE:OpenVDB::openvdb> -Wl,--pop-state")
endif()

if(BUILD_TESTING)
  find_package(GTest REQUIRED)
  find_package(Qt5 5.15 REQUIRED COMPONENTS Test)
  find_package(benchmark REQUIRED)
  pkg_check_modules(umockdev REQUIRED IMPORTED_TARGET umockdev-1.0)

  # Debian's own Python has the packages of deploy/packages.txt. Another python3 in PATH may not have them.
  find_program(OSTEON_PYTHON python3 PATHS /usr/bin NO_DEFAULT_PATH REQUIRED)
endif()
