#include "haptic_client/app/laws_command.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <set>
#include <sstream>
#include <string>

#include "common/mechanics/force_law.hpp"
#include "common/tools/tool_rules.hpp"

namespace osteon::haptic {
namespace {

using nlohmann::json;

TEST(LawsCommand, ListsEveryLawWithAllThatIsToBeKnown) {
  const std::string text = laws_text();
  std::size_t at = 0;
  for (const ForceLaw& law : force_laws()) {
    at = text.find("\n" + std::string(law.name) + ": ", at);
    ASSERT_NE(at, std::string::npos) << law.name;
    const std::size_t end = std::min(text.find("\n\n", at), text.size());
    const std::string paragraph = text.substr(at, end - at);
    for (const char* label :
         {"equation", "source", "units", "constants", "wear", "range", "notes", "fits", "default of"})
      EXPECT_NE(paragraph.find("\n  " + std::string(label) + " "), std::string::npos) << law.name << " " << label;
    // The tools for which a law can be chosen: all that fit, and no more.
    for (const auto& [kind, name] : tool_kinds()) {
      Tool tool;
      tool.kind = kind;
      const std::size_t fits = paragraph.find("\n  fits "), defaults = paragraph.find("\n  default of ");
      std::istringstream words(paragraph.substr(fits, defaults - fits));
      std::set<std::string> named;
      for (std::string word; words >> word;) named.insert(word.back() == ',' ? word.substr(0, word.size() - 1) : word);
      EXPECT_EQ(named.contains(std::string(name)), tool.cuts() && law.fits(kind)) << law.name << " " << name;
    }
    if (!law.number.empty()) {
      EXPECT_NE(paragraph.find("(" + std::string(law.number) + " of"), std::string::npos) << paragraph;
    }
  }
}

TEST(LawsCommand, FitsATerminal) {
  std::istringstream lines(laws_text());
  for (std::string line; std::getline(lines, line);) {
    EXPECT_LE(line.size(), 110u) << line;
    EXPECT_TRUE(line.empty() || line.back() != ' ') << line;
  }
}

TEST(LawsCommand, JsonHasTheSameAndTheDefaultOfEveryToolThatCuts) {
  const json out = json::parse(laws_json());
  std::set<std::string> names;
  for (const json& law : out.at("laws")) names.insert(law.at("name"));
  EXPECT_EQ(names.size(), force_laws().size());
  for (const auto& [kind, name] : tool_kinds()) {
    Tool tool;
    tool.kind = kind;
    ASSERT_EQ(out.at("defaults").contains(std::string(name)), tool.cuts()) << name;
    if (!tool.cuts()) continue;
    const std::string law = out.at("defaults").at(std::string(name));
    EXPECT_TRUE(names.contains(law));
    for (const json& listed : out.at("laws"))
      if (listed.at("name") == law) {
        EXPECT_NE(std::ranges::find(listed.at("tools"), json(name)), listed.at("tools").end()) << name;
      }
  }
}

// Points of comparison, 1000 rpm and 1 mm/s.
TEST(LawsCommand, JsonComputesThePointsOfComparison) {
  const json out = json::parse(laws_json());
  std::set<std::string> laws;
  int chi = 0;
  for (const json& point : out.at("points")) {
    laws.insert(point.at("law"));
    EXPECT_NEAR(point.at("feed_of_force_mm_per_s").get<double>(), point.at("feed_mm_per_s").get<double>(), 1e-9);
    if (point.at("law") == "chi" && point.at("density_g_cm3") == 1.8) {
      EXPECT_NEAR(point.at("force_n").get<double>(), 27.1, 0.06);
      EXPECT_EQ(point.at("outside_range"), "");
      ++chi;
    }
    if (point.at("law") == "allotta") {
      EXPECT_NEAR(point.at("work_mj_per_mm3").get<double>(), 650.0, 1e-6);
    }
  }
  EXPECT_EQ(chi, 1);
  EXPECT_EQ(laws.size(), force_laws().size());
}

}  // namespace
}  // namespace osteon::haptic
