#include "server/import/scan_arguments.hpp"

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <system_error>
#include <utility>

#include "common/runtime/number_option.hpp"
#include "server/import/command.hpp"
#include "server/import/dicom_reader.hpp"
#include "server/import/found_files.hpp"
#include "server/import/grey_stack.hpp"
#include "server/import/inv3_reader.hpp"
#include "server/import/raw_volume.hpp"
#include "server/import/volume_reader.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

std::string_view name_of_one_scan(InputKind kind) {
  if (kind == InputKind::inv3) return "an InVesalius project";
  return kind == InputKind::volume_file ? "a volume in one file" : "";
}

// The first option that only raw numbers take; empty if none is given.
std::string_view raw_option(const ScanArguments& a) {
  if (!a.type.empty()) return "--type";
  if (!a.byte_order.empty()) return "--byte-order";
  return a.skip_bytes ? "--skip-bytes" : "";
}

// The first option of a file that says nothing of itself; empty if none is given.
std::string_view given_option(const ScanArguments& a) {
  if (a.slope) return "--slope";
  if (a.intercept) return "--intercept";
  if (!a.axes.empty()) return "--axes";
  if (!a.grey_window.empty()) return "--grey-window";
  return raw_option(a);
}

Result<GivenGeometry> given_geometry(const ScanArguments& a) {
  GivenGeometry given;
  const auto spacing = parse_spacing(a.spacing);
  if (!spacing) return tl::unexpected(spacing.error());
  given.spacing_mm = *spacing;
  if (!a.axes.empty()) {
    const auto directions = parse_axes(a.axes);
    if (!directions) return tl::unexpected(directions.error());
    given.directions = *directions;
  }
  given.slope = a.slope.value_or(1.0);
  given.intercept = a.intercept.value_or(0.0);
  if (!std::isfinite(given.slope) || given.slope == 0.0 || !std::isfinite(given.intercept))
    return bad_input(
        "--slope and --intercept must be finite numbers, and the slope not 0; HU are slope times the stored "
        "number plus intercept");
  return given;
}

Result<CtScan> read_raw(const ScanArguments& a, const KeepGoing& reading) {
  if (a.spacing.empty()) return bad_input("--size needs --spacing, the size of a voxel in mm, such as 0.5,0.5,1");
  if (!a.grey_window.empty())
    return bad_input("--grey-window is for PNG slices; give --slope and --intercept of raw numbers");
  RawFormat format;
  const auto size = parse_size(a.size);
  if (!size) return tl::unexpected(size.error());
  auto given = given_geometry(a);
  if (!given) return tl::unexpected(given.error());
  format.size = *size;
  format.given = *given;
  format.type = a.type == "uint16"    ? RawType::uint16
                : a.type == "uint8"   ? RawType::uint8
                : a.type == "float32" ? RawType::float32
                                      : RawType::int16;
  format.big_endian = a.byte_order == "big";
  format.skip_bytes = a.skip_bytes.value_or(0);
  return read_raw_volume(a.input, format, reading);
}

Result<CtScan> read_grey(const ScanArguments& a, const KeepGoing& reading) {
  if (const std::string_view option = raw_option(a); !option.empty())
    return bad_input(std::string(option) + " is for raw numbers; give --size X,Y,Z too, or leave it out");
  const auto given = given_geometry(a);
  if (!given) return tl::unexpected(given.error());
  GreyFormat format{*given, {}};
  if (!a.grey_window.empty()) {
    if (a.slope || a.intercept)
      return bad_input("--grey-window takes the place of --slope and --intercept; give either");
    const auto window = parse_pair(a.grey_window);
    if (!window || !(window->second > 1.0))
      return bad_input("--grey-window " + a.grey_window +
                       " is not a window; write its centre and its width of more than 1 HU, such as 400,1800");
    format.window = {window->first, window->second};
  }
  return read_grey_stack(a.input, format, reading);
}

Result<CtScan> read_any_scan(const ScanArguments& a, const KeepGoing& reading) {
  const bool is_given = !a.size.empty() || !a.spacing.empty();
  if (is_given && a.series) return bad_input("--series is for DICOM; leave it out for raw numbers and PNG slices");
  if (const std::string_view option = given_option(a); !is_given && !option.empty())
    return bad_input(std::string(option) + " is for raw numbers and PNG slices; give --spacing too, or leave it out");
  if (!a.size.empty()) return read_raw(a, reading);
  if (is_given) return read_grey(a, reading);
  if (Result<void> scan = check_no_case_file(a.input); !scan) return tl::unexpected(scan.error());
  const InputKind kind = input_kind(a.input, reading);
  if (!reading(0.0)) return tl::unexpected(stopped());
  if (kind == InputKind::absent)
    return failure(ErrorCode::not_found, "there is no file or folder " + a.input +
                                             "; give a folder, zip or ISO image with a CT series, or a NIfTI, "
                                             "NRRD, MetaImage or .inv3 file");
  if (const std::string_view one = name_of_one_scan(kind); a.series && !one.empty())
    return bad_input("--series is for DICOM; leave it out, because " + a.input + " is " + std::string(one) +
                     " with one scan");
  if (kind == InputKind::volume_file) return read_volume(a.input, reading);
  if (kind != InputKind::inv3 && kind != InputKind::other)
    return read_dicom_series(a.input, {.series = a.series}, reading);
  std::error_code error;
  if (!fs::is_regular_file(a.input, error))
    return failure(ErrorCode::invalid_input, a.input + " is a pipe or device; give a folder or a file");
  if (kind == InputKind::other && fs::path(a.input).extension() != ".inv3")
    return bad_input(
        a.input +
        " is no DICOM, NIfTI, NRRD, MetaImage or InVesalius file; give one, or --size, --spacing and --type "
        "if it holds raw numbers");
  return read_inv3(a.input, reading);
}

// The names of a scan's options in an error, as the command has them.
std::string with_prefix(std::string message, const std::string& prefix) {
  for (const char* name :
       {"series", "spacing", "axes", "slope", "intercept", "grey-window", "size", "type", "byte-order", "skip-bytes"}) {
    const std::string option = std::string("--") + name;
    for (std::size_t at = 0; (at = message.find(option, at)) != std::string::npos; at += option.size() + prefix.size())
      message.insert(at + 2, prefix);
  }
  return message;
}

}  // namespace

Result<void> check_no_case_file(const std::string& input) {
  // A case file begins as a zip archive whose first file is case.json.
  constexpr std::string_view kBegin = "PK\3\4", kFirst = "case.json";
  constexpr std::size_t kNameAt = 30;
  std::error_code error;
  if (!fs::is_regular_file(input, error)) return {};
  std::string head(kNameAt + kFirst.size(), '\0');
  std::ifstream(input, std::ios::binary).read(head.data(), static_cast<std::streamsize>(head.size()));
  if (!head.starts_with(kBegin) || !head.ends_with(kFirst)) return {};
  return bad_input(input + " is a case file, not a scan; unpack it first with: osteon-import unpack " + input +
                   " --out FOLDER");
}

std::string_view name_of_one_scan(const std::string& input, const KeepGoing& keep_going) {
  return name_of_one_scan(input_kind(input, keep_going));
}

std::optional<std::pair<double, double>> parse_pair(const std::string& text) {
  double first = 0, second = 0;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%lf,%lf%c", &first, &second, &rest) != 2) return {};
  if (!std::isfinite(first) || !std::isfinite(second)) return {};
  return std::pair(first, second);
}

Result<Vec3> parse_spacing(const std::string& text) {
  double x = 0, y = 0, z = 0;
  char rest = 0;
  const int parts = std::sscanf(text.c_str(), "%lf,%lf,%lf%c", &x, &y, &z, &rest);
  const Vec3 spacing = parts == 1 && text.find(',') == std::string::npos ? Vec3::Constant(x) : Vec3(x, y, z);
  if ((parts != 3 && parts != 1) || !(spacing.minCoeff() >= 0.01) || !(spacing.maxCoeff() <= 10.0))
    return failure(
        ErrorCode::invalid_input,
        "--spacing " + text + " is not a voxel size; write X,Y,Z in mm from 0.01 to 10, such as 0.096,0.096,0.096");
  return spacing;
}

void add_scan_options(CLI::App& command, ScanArguments& a, const std::string& name) {
  const std::string dashes = "--" + a.prefix;
  command
      .add_option(name, a.input,
                  "DICOM: a folder (with all its subfolders), a zip or an ISO image; an InVesalius project (.inv3), or "
                  "a NIfTI, NRRD or MetaImage file. With " +
                      dashes + "spacing: a folder of grey PNG slices. With " + dashes +
                      "size: raw numbers, in one file or in a folder with one for each slice")
      ->required();
  command.add_option(dashes + "series", a.series,
                     "Number of the series, as osteon-import series lists them (default: the largest CT)");
  const std::string given = "Of raw numbers and PNG slices" + (a.prefix.empty() ? "" : ", " + name);
  command.add_option(dashes + "spacing", a.spacing, "Size of a voxel, mm: X,Y,Z, or one number for all")->group(given);
  command
      .add_option(dashes + "axes", a.axes,
                  "Where columns, rows and slices go: L or R, P or A, S or I (default: LPS, as a guess)")
      ->group(given);
  command.add_option(dashes + "slope", a.slope, "HU = slope * stored number + intercept (default: 1)")->group(given);
  command.add_option(dashes + "intercept", a.intercept, "HU of the stored number 0 (default: 0)")->group(given);
  command
      .add_option(dashes + "grey-window", a.grey_window,
                  "CENTRE,WIDTH: the HU that PNG slices show from black to white")
      ->group(given);
  command.add_option(dashes + "size", a.size, "Columns, rows and slices of raw numbers: X,Y,Z")->group(given);
  command.add_option(dashes + "type", a.type, "Of raw numbers: int16, uint16, uint8 or float32 (default: int16)")
      ->check(CLI::IsMember({"int16", "uint16", "uint8", "float32"}))
      ->group(given);
  command.add_option(dashes + "byte-order", a.byte_order, "Of raw numbers: little or big endian (default: little)")
      ->check(CLI::IsMember({"little", "big"}))
      ->group(given);
  command.add_option(dashes + "skip-bytes", a.skip_bytes, "Before the first raw number of each file (default: 0)")
      ->group(given);
}

void add_filter_options(CLI::App& command, FilterArguments& a) {
  command
      .add_option("--median", a.median,
                  "First replace each voxel by the median of its 3 x 3 neighbours in the slice, or of its 3 x 3 x 3 in "
                  "the volume: takes out single wrong voxels")
      ->check(CLI::IsMember({"slice", "volume"}));
  command
      .add_option("--gaussian", a.gaussian_mm,
                  "First smooth the scan with a Gaussian of this sigma, mm: takes out noise")
      ->check(number_in(0.0, 10.0));
}

void add_edge_options(CLI::App& command, EdgeArguments& a) {
  command.add_option("--sigma", a.sigma_mm, "Of edges: smooth with a Gaussian of this sigma first, mm")
      ->check(number_in(0.0, 10.0))
      ->capture_default_str();
  command
      .add_option("--limits", a.limits,
                  "LOW,HIGH of edges, HU/mm: a line begins at the higher gradient and goes on to the lower one")
      ->capture_default_str();
  command.add_option("--edges-in", a.space, "Find edges in each slice by itself, or in the whole volume")
      ->check(CLI::IsMember({"slice", "volume"}))
      ->capture_default_str();
}

Result<imaging::CannyParams> canny_params(const EdgeArguments& a) {
  const auto limits = parse_pair(a.limits);
  if (!limits || !(limits->first > 0.0) || !(limits->first <= limits->second))
    return bad_input("--limits " + a.limits +
                     " are not limits of a gradient; write the lower and the higher one in "
                     "HU/mm, above 0, such as 100,300");
  return imaging::CannyParams{a.sigma_mm, limits->first, limits->second,
                              a.space == "slice" ? imaging::EdgeSpace::slice : imaging::EdgeSpace::volume};
}

std::optional<imaging::MedianBox> median_box(const FilterArguments& a) {
  if (a.median.empty()) return {};
  return a.median == "slice" ? imaging::MedianBox::slice : imaging::MedianBox::volume;
}

Result<CtScan> read_scan(const ScanArguments& a, const KeepGoing& reading) {
  auto scan = read_any_scan(a, reading);
  if (!scan && !a.prefix.empty())
    return failure(scan.error().code, with_prefix(std::move(scan.error().message), a.prefix));
  return scan;
}

}  // namespace osteon::import
