// Names of structures in label maps, and what a case makes of them.
#pragma once
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.hpp"
#include "common/volume/case_description.hpp"

namespace osteon::import {

struct Structure {
  std::string name;
  std::optional<LabelKind> kind;  // absent: the case leaves it out
};

// Bone, its tissues, and metal in it: a case has them as its bone. All other kinds are structures at risk, which only
// the case's scan has.
[[nodiscard]] bool is_carved(LabelKind kind);

// The words of a name in small letters: letters and digits, whatever stands between them.
[[nodiscard]] std::vector<std::string> words_of(std::string_view name);
// Whether a small word names a tissue of bone, such as cortical, cancellous or marrow.
[[nodiscard]] bool is_tissue_word(std::string_view word);

// The structure that a name means, by its words: English and Latin names of bones, nerves, vessels, organs and muscles
// in any order, with sides, levels such as L1, and numbers. All classes of TotalSegmentator's task "total" are known.
// Nothing if any word is unknown, so the name of a person is never taken for that of a structure.
[[nodiscard]] std::optional<Structure> known_structure(std::string_view name);

// Names that a person gives to the labels of a file.
struct LabelNames {
  bool totalsegmentator = false;           // numbers are those of TotalSegmentator's task "total", version 2
  std::map<std::string, Structure> given;  // by the number of a label, or its name in the file
};

// Texts, each "totalsegmentator" or FROM=NAME or FROM=NAME:KIND, with commas between several. FROM is the number of a
// label, or its name in the file. KIND is a LabelKind, or none to leave it out. Error: invalid_input, with the remedy.
[[nodiscard]] Result<LabelNames> parse_label_names(const std::vector<std::string>& texts);

// The name of a class of TotalSegmentator's task "total", version 2; empty for a number that it does not have.
[[nodiscard]] std::string totalsegmentator_name(int number);

// "bone, cortical, ..., soft_tissue or none", for errors and help.
[[nodiscard]] std::string kind_choice_text();

}  // namespace osteon::import
