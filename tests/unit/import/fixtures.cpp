#include "tests/unit/import/fixtures.hpp"

#include <archive.h>
#include <archive_entry.h>
#include <gdcmReader.h>
#include <gdcmWriter.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>

#include "server/import/dicom_writer.hpp"

namespace osteon::import {

namespace fs = std::filesystem;

Result<Case> import_bone(CtScan scan, const CtOptions& options, const KeepGoing& going) {
  auto made = import_ct(std::move(scan), options, going);
  if (!made) return tl::unexpected(made.error());
  return std::move(*made->bone);
}

Phantom small_block() { return {.kind = PhantomKind::block, .layers = {{6.0, 1.5}}, .width_mm = 4.0}; }

void write_small_series(const fs::path& folder) {
  const auto scan = scan_phantom(small_block(), 1.0, keep_going);
  ASSERT_TRUE(scan);
  const auto written = write_dicom_series(*scan, folder, keep_going);
  ASSERT_TRUE(written) << written.error().message;
}

std::vector<fs::path> files_of(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
  std::ranges::sort(files);
  return files;
}

namespace {

template <class Change>
void edit(const fs::path& file, Change change) {
  gdcm::Reader reader;
  reader.SetFileName(file.c_str());
  ASSERT_TRUE(reader.Read());
  change(reader.GetFile().GetDataSet());
  gdcm::Writer writer;
  writer.SetFile(reader.GetFile());
  writer.SetFileName(file.c_str());
  ASSERT_TRUE(writer.Write());
}

}  // namespace

void set_tag(const fs::path& file, std::uint16_t group, std::uint16_t element, const std::string& value,
             int vr_if_new) {
  edit(file, [&](gdcm::DataSet& data) {
    const gdcm::Tag tag(group, element);
    gdcm::DataElement changed(tag);
    if (data.FindDataElement(tag))
      changed.SetVR(data.GetDataElement(tag).GetVR());
    else
      changed.SetVR(vr_if_new == 0 ? gdcm::VR(gdcm::VR::IS) : gdcm::VR(static_cast<gdcm::VR::VRType>(vr_if_new)));
    const std::string even = value.size() % 2 == 0 ? value : value + ' ';
    changed.SetByteValue(even.data(), static_cast<std::uint32_t>(even.size()));
    data.Replace(changed);
  });
}

void remove_tag(const fs::path& file, std::uint16_t group, std::uint16_t element) {
  edit(file, [&](gdcm::DataSet& data) { data.Remove(gdcm::Tag(group, element)); });
}

void write_inv3(const fs::path& file, const Inv3& project) {
  const auto integer = [](int n) { return "<integer>" + std::to_string(n) + "</integer>"; };
  const std::string list =
      "<?xml version=\"1.0\"?><plist version=\"1.0\"><dict><key>modality</key><string>" + project.modality +
      "</string><key>name</key><string>Somebody's name</string><key>orientation</key><integer>" + project.orientation +
      "</integer><key>matrix</key><dict><key>dtype</key><string>" + project.dtype +
      "</string><key>filename</key><string>matrix.dat</string><key>shape</key><array>" + integer(project.slices) +
      integer(project.rows) + integer(project.columns) + "</array></dict><key>spacing</key><array>" + project.spacing +
      "</array></dict></plist>";
  std::string matrix;
  for (int k = 0; k < project.slices; ++k)
    for (int j = 0; j < project.rows; ++j)
      for (int i = 0; i < project.columns; ++i) {
        const auto hu = static_cast<std::int16_t>(i + 100 * j + 1000 * k);
        matrix.append(reinterpret_cast<const char*>(&hu), sizeof hu);
      }
  matrix.resize(matrix.size() - project.missing_bytes);

  archive* a = archive_write_new();
  archive_write_add_filter_gzip(a);
  archive_write_set_format_pax_restricted(a);
  ASSERT_EQ(archive_write_open_filename(a, file.c_str()), ARCHIVE_OK);
  const auto add = [&](const char* name, const std::string& content) {
    archive_entry* entry = archive_entry_new();
    archive_entry_set_pathname(entry, name);
    archive_entry_set_size(entry, static_cast<la_int64_t>(content.size()));
    archive_entry_set_filetype(entry, AE_IFREG);
    archive_entry_set_perm(entry, 0644);
    ASSERT_EQ(archive_write_header(a, entry), ARCHIVE_OK);
    ASSERT_EQ(archive_write_data(a, content.data(), content.size()), static_cast<la_ssize_t>(content.size()));
    archive_entry_free(entry);
  };
  // The matrix comes first, as an archive may order its files.
  if (project.with_matrix) add("tmp/matrix.dat", matrix);
  if (project.with_list) add("tmp/main.plist", list);
  if (!project.with_list && !project.with_matrix) add("tmp/other.txt", "nothing");
  archive_write_close(a);
  archive_write_free(a);
}

imaging::HuVolume numbered_volume(int columns, int rows, int slices) {
  imaging::HuVolume volume;
  volume.dims = {columns, rows, slices};
  volume.spacing_mm = {0.5, 0.75, 1.25};
  volume.origin_mm = {-100.5, 20.25, -1300.0};
  volume.values.resize(volume.count());
  for (std::size_t i = 0; i < volume.values.size(); ++i)
    volume.values[i] = static_cast<std::int16_t>(static_cast<int>(17 * i) % 4000 - 1024);
  return volume;
}

void expect_same(const imaging::HuVolume& a, const imaging::HuVolume& b) {
  EXPECT_EQ(a.dims, b.dims);
  EXPECT_LT((a.spacing_mm - b.spacing_mm).norm(), 1e-6);
  EXPECT_LT((a.origin_mm - b.origin_mm).norm(), 1e-6);
  EXPECT_LT((a.directions - b.directions).norm(), 1e-6);
  EXPECT_EQ(a.values, b.values);
}

void write_object(const fs::path& file, const std::string& sop_class, const std::string& modality,
                  const std::string& image_type) {
  const auto u16 = [](std::size_t n) { return std::string{static_cast<char>(n & 0xff), static_cast<char>(n >> 8)}; };
  const auto element = [&](std::uint16_t group, std::uint16_t tag, const char* vr, std::string value) {
    if (value.size() % 2 != 0) value += vr == std::string("UI") ? '\0' : ' ';
    return u16(group) + u16(tag) + vr + u16(value.size()) + value;
  };
  const std::string meta =
      element(2, 2, "UI", sop_class) + element(2, 3, "UI", "1.2.3.4.5") + element(2, 0x10, "UI", "1.2.840.10008.1.2.1");
  std::ofstream out(file, std::ios::binary);
  out << std::string(128, '\0') << "DICM" << element(2, 0, "UL", u16(meta.size()) + u16(0)) << meta;
  if (sop_class == "1.2.840.10008.1.3.10") {
    out << element(4, 0x1130, "CS", "OSTEON");
    return;
  }
  if (!image_type.empty()) out << element(8, 8, "CS", image_type);
  out << element(8, 0x16, "UI", sop_class) << element(8, 0x18, "UI", "1.2.3.4.5") << element(8, 0x60, "CS", modality);
  out << element(0x10, 0x10, "PN", "Surname^Forename") << element(0x20, 0x0e, "UI", "1.2.3.4");
}

void write_archive(const fs::path& folder, const fs::path& file, const std::string& format) {
  archive* a = archive_write_new();
  ASSERT_EQ(archive_write_set_format_by_name(a, format == "secret" ? "zip" : format.c_str()), ARCHIVE_OK);
  if (format == "secret") {
    ASSERT_EQ(archive_write_set_options(a, "zip:encryption=traditional"), ARCHIVE_OK);
    ASSERT_EQ(archive_write_set_passphrase(a, "secret"), ARCHIVE_OK);
  }
  ASSERT_EQ(archive_write_open_filename(a, file.c_str()), ARCHIVE_OK);
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) files.push_back(entry.path());
  std::ranges::sort(files);
  for (const fs::path& path : files) {
    archive_entry* entry = archive_entry_new();
    archive_entry_set_pathname(entry, path.lexically_relative(folder).c_str());
    archive_entry_set_perm(entry, fs::is_directory(path) ? 0755 : 0644);
    archive_entry_set_filetype(entry, fs::is_directory(path) ? AE_IFDIR : AE_IFREG);
    std::string content;
    if (fs::is_regular_file(path)) {
      std::ifstream in(path, std::ios::binary);
      content.assign(std::istreambuf_iterator<char>(in), {});
    }
    archive_entry_set_size(entry, static_cast<la_int64_t>(content.size()));
    ASSERT_EQ(archive_write_header(a, entry), ARCHIVE_OK);
    if (!content.empty()) {
      ASSERT_EQ(archive_write_data(a, content.data(), content.size()), static_cast<la_ssize_t>(content.size()));
    }
    archive_entry_free(entry);
  }
  ASSERT_EQ(archive_write_close(a), ARCHIVE_OK);
  archive_write_free(a);
}

void truncate_file(const fs::path& file, double part) {
  fs::resize_file(file, static_cast<std::uintmax_t>(part * static_cast<double>(fs::file_size(file))));
}

void expect_one_sentence(const Error& error, const std::string& what) {
  const std::string& text = error.message;
  EXPECT_EQ(text.find('\n'), std::string::npos) << text;
  EXPECT_NE(text.find(what), std::string::npos) << text << "\nshould name " << what;
  EXPECT_FALSE(text.ends_with('.')) << text;
  EXPECT_LT(text.size(), 400u) << text;
}

}  // namespace osteon::import
