#include "tests/unit/import/fixtures.hpp"

#include <archive.h>
#include <archive_entry.h>
#include <gdcmReader.h>
#include <gdcmWriter.h>

#include <algorithm>
#include <cstdlib>

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

void set_tag(const fs::path& file, std::uint16_t group, std::uint16_t element, const std::string& value) {
  edit(file, [&](gdcm::DataSet& data) {
    const gdcm::Tag tag(group, element);
    gdcm::DataElement changed(tag);
    if (data.FindDataElement(tag)) changed.SetVR(data.GetDataElement(tag).GetVR());
    else changed.SetVR(gdcm::VR::IS);
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
  const std::string list = "<?xml version=\"1.0\"?><plist version=\"1.0\"><dict><key>modality</key><string>" + project.modality +
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
  // The matrix first, as an archive may order them.
  if (project.with_matrix) add("tmp/matrix.dat", matrix);
  if (project.with_list) add("tmp/main.plist", list);
  if (!project.with_list && !project.with_matrix) add("tmp/other.txt", "nothing");
  archive_write_close(a);
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
