// Small scans and projects. The tests of the importer damage each of them in one way.
#pragma once
#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/core/result.hpp"
#include "server/import/ct_import.hpp"
#include "server/import/phantom.hpp"

namespace osteon::import {

inline bool keep_going(double) { return true; }

// import_ct() without the list of islands.
[[nodiscard]] Result<Case> import_bone(CtScan scan, const CtOptions& options, const KeepGoing& keep_going);

// 4 x 4 x 6 mm of 1.5 g/cm³.
[[nodiscard]] Phantom small_block();

// Writes a DICOM series of the small block: about 20 slices of 1 mm. Names and positions have the same order.
void write_small_series(const std::filesystem::path& folder);
[[nodiscard]] std::vector<std::filesystem::path> files_of(const std::filesystem::path& folder);

// Sets or removes an attribute of a DICOM file. The file otherwise stays valid.
void set_tag(const std::filesystem::path& file, std::uint16_t group, std::uint16_t element, const std::string& value,
             int vr_if_new = 0);
void remove_tag(const std::filesystem::path& file, std::uint16_t group, std::uint16_t element);

// An InVesalius project of `columns` x `rows` x `slices` whose voxel value is column + 100 row + 1000 slice.
struct Inv3 {
  int columns = 4, rows = 5, slices = 6;
  std::string modality = "CT";
  std::string dtype = "int16";
  std::string orientation = "1";
  std::string spacing = "<real>0.5</real><real>0.75</real><real>2.0</real>";
  bool with_list = true;
  bool with_matrix = true;
  std::size_t missing_bytes = 0;  // of the matrix
};
void write_inv3(const std::filesystem::path& file, const Inv3& project);

// A scan with different values along each axis.
[[nodiscard]] imaging::HuVolume numbered_volume(int columns, int rows, int slices);
void expect_same(const imaging::HuVolume& a, const imaging::HuVolume& b);

// A DICOM file without an image, as a recorder of CDs or of doses writes it.
void write_object(const std::filesystem::path& file, const std::string& sop_class, const std::string& modality,
                  const std::string& image_type = {});

// Packs everything below a folder into one archive: "zip", "iso9660", "pax", or "secret" for a zip with a password.
void write_archive(const std::filesystem::path& folder, const std::filesystem::path& file, const std::string& format);

// Keeps the first bytes of a file.
void truncate_file(const std::filesystem::path& file, double part);

// Expects one sentence that names `what` and then gives a remedy.
void expect_one_sentence(const Error& error, const std::string& what);

}  // namespace osteon::import
