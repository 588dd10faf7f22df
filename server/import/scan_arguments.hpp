// The scan that a command of osteon-import reads, as its command line names it.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "common/core/keep_going.hpp"
#include "common/imaging/edges.hpp"
#include "common/imaging/smoothing.hpp"
#include "server/import/ct_scan.hpp"

namespace CLI {  // the library's
class App;
}

namespace osteon::import {

struct ScanArguments {
  std::string input;
  std::string prefix;  // of the options' names, such as "fixed-" for one of two scans
  std::optional<int> series;
  // Of raw numbers and PNG slices, which say nothing of themselves.
  std::string size, spacing, type, byte_order, axes, grey_window;
  std::optional<std::uint64_t> skip_bytes;
  std::optional<double> slope, intercept;
};

// `arguments` must live as long as the app. `name`: of the input in the help.
void add_scan_options(CLI::App& command, ScanArguments& arguments, const std::string& name = "INPUT");

// Reads a scan of any kind. With --size the input is raw numbers, with --spacing alone it is PNG slices; otherwise the
// input's content decides. Errors: those of the readers, and invalid_input for options that do not fit.
[[nodiscard]] Result<CtScan> read_scan(const ScanArguments& arguments, const KeepGoing& reading);

// Error invalid_input: the input is a case file, which must be unpacked first. The error says how.
[[nodiscard]] Result<void> check_no_case_file(const std::string& input);

// The filters that come before anything else.
struct FilterArguments {
  std::string median;  // slice, volume, or empty: none
  double gaussian_mm = 0.0;
};
void add_filter_options(CLI::App& command, FilterArguments& arguments);
[[nodiscard]] std::optional<imaging::MedianBox> median_box(const FilterArguments& arguments);

// How edges are found, see imaging::canny_edges().
struct EdgeArguments {
  double sigma_mm = 1.0;
  std::string space = "volume", limits = "100,300";
};
void add_edge_options(CLI::App& command, EdgeArguments& arguments);
// Error: invalid_input (the limits).
[[nodiscard]] Result<imaging::CannyParams> canny_params(const EdgeArguments& arguments);

// What an input is that has one scan and no series; empty for others.
[[nodiscard]] std::string_view name_of_one_scan(const std::string& input, const KeepGoing& keep_going);

// "X,Y,Z", or one number for all, mm. Error: invalid_input.
[[nodiscard]] Result<Vec3> parse_spacing(const std::string& text);
// "A,B", both finite.
[[nodiscard]] std::optional<std::pair<double, double>> parse_pair(const std::string& text);

}  // namespace osteon::import
