// The report of an import as one page that needs no other file.
#pragma once
#include <string>

#include "server/import/report_facts.hpp"

namespace osteon::import {

// The bytes of PNG files; an empty one is left out.
struct ReportImages {
  std::string montage, islands, histogram;
};

// HTML 5 in UTF-8. Pictures are in it as data: addresses. Error: internal (memory).
[[nodiscard]] Result<std::string> to_html(const ReportFacts& facts, const ReportImages& images);

}  // namespace osteon::import
