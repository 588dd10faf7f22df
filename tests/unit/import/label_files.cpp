#include "tests/unit/import/label_files.hpp"

#include <archive.h>
#include <archive_entry.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <memory>
#include <sstream>

#include "common/core/check.hpp"
#include "tests/unit/import/dicom_elements.hpp"

namespace osteon::import {
namespace {

template <class T>
void put_at(std::string& bytes, std::size_t at, T value) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

std::string numbers(const std::vector<double>& values, char between) {
  std::ostringstream text;
  text.precision(12);
  for (std::size_t i = 0; i < values.size(); ++i) (i == 0 ? text : text << between) << values[i];
  return text.str();
}

std::string vector_text(const Vec3& v) { return "(" + numbers({v.x(), v.y(), v.z()}, ',') + ")"; }

std::string caret_names(const std::vector<std::pair<int, std::string>>& names) {
  std::string xml =
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?> <CaretExtension> <VolumeInformation Index=\"0\"> <LabelTable>\n";
  for (const auto& [number, name] : names)
    xml += "<Label Key=\"" + std::to_string(number) + "\" Red=\"1\" Alpha=\"1\"><![CDATA[" + name + "]]></Label>\n";
  xml += "</LabelTable> </VolumeInformation> </CaretExtension>\n  ";
  xml.resize((xml.size() + 8 + 15) / 16 * 16 - 8, '\0');
  std::string bytes(8, '\0');
  put_at(bytes, 0, static_cast<std::int32_t>(xml.size() + 8));
  return bytes + xml;
}

std::string short_element(std::uint16_t group, std::uint16_t number, int value) {
  return element(group, number, "US", little_endian(static_cast<std::size_t>(value), 2));
}
std::string code(const std::string& value, const std::string& meaning) {
  return item(element(8, 0x100, "SH", value) + element(8, 0x102, "SH", "SCT") + element(8, 0x104, "LO", meaning));
}

struct SegFrame {
  const SegSegment* segment;
  int slice;
};

std::vector<SegFrame> frames_of(const TestGrid& grid, const std::vector<SegSegment>& segments, bool with_empty) {
  const std::size_t area = static_cast<std::size_t>(grid.dims[0]) * static_cast<std::size_t>(grid.dims[1]);
  std::vector<SegFrame> frames;
  for (const SegSegment& segment : segments)
    for (int slice = grid.dims[2] - 1; slice >= 0; --slice) {
      bool any = with_empty;
      for (std::size_t i = 0; i < area; ++i) any = any || segment.mask[static_cast<std::size_t>(slice) * area + i] != 0;
      if (any) frames.push_back({&segment, slice});
    }
  return frames;
}

// One bit for each pixel, frame after frame without gaps, the lowest bit first.
std::string bits_of(const TestGrid& grid, const std::vector<SegFrame>& frames) {
  const std::size_t area = static_cast<std::size_t>(grid.dims[0]) * static_cast<std::size_t>(grid.dims[1]);
  std::string bytes((frames.size() * area + 7) / 8, '\0');
  std::size_t bit = 0;
  for (const SegFrame& frame : frames)
    for (std::size_t i = 0; i < area; ++i, ++bit)
      if (frame.segment->mask[static_cast<std::size_t>(frame.slice) * area + i] != 0)
        bytes[bit / 8] = static_cast<char>(bytes[bit / 8] | 1 << bit % 8);
  return bytes;
}

using Archive = std::unique_ptr<archive, decltype(&archive_write_free)>;

}  // namespace

std::vector<int> labels_of(const TestGrid& grid, const LabelAt& label_at) {
  std::vector<int> labels;
  for (int k = 0; k < grid.dims[2]; ++k)
    for (int j = 0; j < grid.dims[1]; ++j)
      for (int i = 0; i < grid.dims[0]; ++i) labels.push_back(label_at(grid.position_mm(i, j, k)));
  return labels;
}

TestGrid turned(const TestGrid& grid, const std::array<int, 3>& order, const std::array<bool, 3>& flipped) {
  TestGrid out;
  out.origin_mm = grid.origin_mm;
  for (int d = 0; d < 3; ++d) {
    const auto n = static_cast<std::size_t>(d);
    const int from = order[n];
    out.dims[n] = grid.dims[static_cast<std::size_t>(from)];
    out.axes_mm.col(d) = grid.axes_mm.col(from) * (flipped[n] ? -1.0 : 1.0);
    if (flipped[n]) out.origin_mm += grid.axes_mm.col(from) * (out.dims[n] - 1);
  }
  return out;
}

std::string nifti_file(const TestGrid& grid, const NiftiVoxels& voxels,
                       const std::vector<std::pair<int, std::string>>& names) {
  std::string h(352, '\0');
  const std::string extension = names.empty() ? "" : caret_names(names);
  put_at(h, 0, std::int32_t{348});
  put_at(h, 40, std::int16_t{3});
  put_at(h, 48, std::int16_t{1});
  for (std::size_t d = 0; d < 3; ++d) {
    put_at(h, 42 + 2 * d, static_cast<std::int16_t>(grid.dims[d]));
    put_at(h, 80 + 4 * d, static_cast<float>(grid.axes_mm.col(static_cast<Eigen::Index>(d)).norm()));
  }
  put_at(h, 70, voxels.code);
  put_at(h, 72, voxels.bits);
  put_at(h, 76, 1.0f);
  put_at(h, 108, static_cast<float>(352 + extension.size()));
  h[123] = 2;  // millimetres
  put_at(h, 254, std::int16_t{1});
  for (Eigen::Index r = 0; r < 3; ++r) {
    const auto row = 280 + 16 * static_cast<std::size_t>(r);
    const double sign = r < 2 ? -1.0 : 1.0;  // from LPS to RAS
    for (Eigen::Index c = 0; c < 3; ++c)
      put_at(h, row + 4 * static_cast<std::size_t>(c), static_cast<float>(sign * grid.axes_mm(r, c)));
    put_at(h, row + 12, static_cast<float>(sign * grid.origin_mm[r]));
  }
  h.replace(344, 3, "n+1");
  if (!extension.empty()) h[348] = 1;
  return h + extension + voxels.bytes;
}

std::string nifti_file(const TestGrid& grid, const LabelAt& label_at) {
  return nifti_file(grid, {.bytes = bytes_of<std::uint8_t>(labels_of(grid, label_at))});
}

std::string nrrd_file(const TestGrid& grid, const std::vector<int>& values, int layers, const std::string& fields) {
  std::ostringstream h;
  h << "NRRD0004\n# a comment\ntype: unsigned char\ndimension: " << (layers > 1 ? 4 : 3)
    << "\nspace: left-posterior-superior\nsizes:";
  if (layers > 1) h << " " << layers;
  for (const int dim : grid.dims) h << " " << dim;
  h << "\nspace directions:" << (layers > 1 ? " none" : "");
  for (Eigen::Index d = 0; d < 3; ++d) h << " " << vector_text(grid.axes_mm.col(d));
  h << "\nkinds:" << (layers > 1 ? " list" : "")
    << " domain domain domain\nencoding: gzip\nspace origin: " << vector_text(grid.origin_mm) << "\n"
    << fields << "\n";
  return h.str() + compressed(bytes_of<std::uint8_t>(values));
}

std::string slicer_segment(int number, const std::string& name, int value, int layer, const std::string& tags) {
  const std::string key = "Segment" + std::to_string(number) + "_";
  return key + "ID:=Segment_" + std::to_string(number) + "\n" + key + "Name:=" + name + "\n" + key +
         "LabelValue:=" + std::to_string(value) + "\n" + key + "Layer:=" + std::to_string(layer) + "\n" + key +
         "Tags:=" + tags + "\n";
}

std::string compressed(const std::string& bytes) {
  std::string out(bytes.size() + 4096, '\0');
  std::size_t used = 0;
  const Archive a(archive_write_new(), archive_write_free);
  archive_write_add_filter_gzip(a.get());
  archive_write_set_format_raw(a.get());
  archive_write_set_bytes_in_last_block(a.get(), 1);
  OSTEON_CHECK(archive_write_open_memory(a.get(), out.data(), out.size(), &used) == ARCHIVE_OK);
  const std::unique_ptr<archive_entry, decltype(&archive_entry_free)> entry(archive_entry_new(), archive_entry_free);
  archive_entry_set_filetype(entry.get(), AE_IFREG);
  OSTEON_CHECK(archive_write_header(a.get(), entry.get()) == ARCHIVE_OK);
  OSTEON_CHECK(archive_write_data(a.get(), bytes.data(), bytes.size()) == static_cast<la_ssize_t>(bytes.size()));
  OSTEON_CHECK(archive_write_close(a.get()) == ARCHIVE_OK);
  out.resize(used);
  return out;
}

std::string uncompressed(const std::string& bytes) {
  const std::unique_ptr<archive, decltype(&archive_read_free)> a(archive_read_new(), archive_read_free);
  archive_read_support_filter_gzip(a.get());
  archive_read_support_format_raw(a.get());
  archive_entry* entry = nullptr;
  OSTEON_CHECK(archive_read_open_memory(a.get(), bytes.data(), bytes.size()) == ARCHIVE_OK);
  OSTEON_CHECK(archive_read_next_header(a.get(), &entry) == ARCHIVE_OK);
  std::string out;
  std::array<char, 4096> part{};
  for (la_ssize_t n = 0; (n = archive_read_data(a.get(), part.data(), part.size())) > 0;)
    out.append(part.data(), static_cast<std::size_t>(n));
  return out;
}

std::string seg_file(const TestGrid& grid, const std::vector<SegSegment>& segments, const SegOptions& options) {
  const Vec3 row = grid.axes_mm.col(0).normalized(), column = grid.axes_mm.col(1).normalized();
  std::string list;
  for (const SegSegment& segment : segments)
    list += item(sequence(0x62, 3, code("123037004", "Anatomical Structure")) + short_element(0x62, 4, segment.number) +
                 element(0x62, 5, "LO", segment.label) + element(0x62, 8, "CS", "MANUAL") +
                 (segment.type.empty() ? "" : sequence(0x62, 0xf, code("0", segment.type))));
  const std::vector<SegFrame> frames = frames_of(grid, segments, options.with_empty_frames);
  std::string per_frame;
  for (std::size_t f = 0; f < frames.size(); ++f) {
    const double shift_mm = f + 1 == frames.size() ? options.shift_mm : 0.0;
    const Vec3 at = grid.position_mm(0, 0, frames[f].slice) + shift_mm * row;
    const std::string position = item(element(0x20, 0x32, "DS", numbers({at.x(), at.y(), at.z()}, '\\')));
    const int number = options.listed_number != 0 ? options.listed_number : frames[f].segment->number;
    per_frame += item((options.without_positions ? "" : sequence(0x20, 0x9113, position)) +
                      sequence(0x62, 0xa, item(short_element(0x62, 0xb, number))));
  }
  const std::string axes = numbers({row.x(), row.y(), row.z(), column.x(), column.y(), column.z()}, '\\');
  const std::string spacing = numbers({grid.axes_mm.col(1).norm(), grid.axes_mm.col(0).norm()}, '\\');
  const std::string gap =
      options.slice_gap_mm > 0.0 ? element(0x18, 0x88, "DS", numbers({options.slice_gap_mm}, '\\')) : std::string();
  const std::string shared = item(sequence(0x20, 0x9116, item(element(0x20, 0x37, "DS", axes))) +
                                  sequence(0x28, 0x9110, item(gap + element(0x28, 0x30, "DS", spacing))));
  std::string pixels = bits_of(grid, frames);
  pixels.resize(pixels.size() - options.missing_bytes);
  const std::string meta = element(2, 2, "UI", options.sop_class) + element(2, 3, "UI", "1.2.3.4.5") +
                           element(2, 0x10, "UI", options.syntax);
  return std::string(128, '\0') + "DICM" + element(2, 0, "UL", little_endian(meta.size(), 4)) + meta +
         element(8, 0x16, "UI", options.sop_class) + element(8, 0x18, "UI", "1.2.3.4.5") +
         element(8, 0x60, "CS", "SEG") + element(0x10, 0x10, "PN", "DOE^JANE") + element(0x10, 0x20, "LO", "PID-4711") +
         element(0x20, 0xe, "UI", "1.2.3.9") + element(0x20, 0x52, "UI", options.frame_of_reference) +
         short_element(0x28, 2, 1) + element(0x28, 4, "CS", "MONOCHROME2") +
         element(0x28, 8, "IS", std::to_string(frames.size())) + short_element(0x28, 0x10, grid.dims[1]) +
         short_element(0x28, 0x11, grid.dims[0]) + short_element(0x28, 0x100, 1) + short_element(0x28, 0x101, 1) +
         short_element(0x28, 0x102, 0) + short_element(0x28, 0x103, 0) + element(0x62, 1, "CS", options.type) +
         sequence(0x62, 2, list) + sequence(0x5200, 0x9229, shared) + sequence(0x5200, 0x9230, per_frame) +
         element(0x7fe0, 0x10, "OB", pixels);
}

void write_bytes(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

CtScan scan_of(const TestGrid& grid, const std::function<int(const Vec3&)>& hu_at) {
  CtScan scan;
  scan.source = "test";
  imaging::HuVolume& volume = scan.volume;
  volume.dims = grid.dims;
  volume.origin_mm = grid.origin_mm;
  for (int d = 0; d < 3; ++d) {
    volume.spacing_mm[d] = grid.axes_mm.col(d).norm();
    volume.directions.col(d) = grid.axes_mm.col(d).normalized();
  }
  for (const int hu : labels_of(grid, hu_at)) volume.values.push_back(static_cast<std::int16_t>(hu));
  return scan;
}

}  // namespace osteon::import
