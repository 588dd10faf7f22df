#include "server/import/structure_names.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <span>
#include <utility>

#include "common/core/bounded_text.hpp"

namespace osteon::import {
namespace {

constexpr std::size_t kMostQuotedName = 60;  // bytes of a name in an error
constexpr const char* kTotalSegmentator = "totalsegmentator";
constexpr const char* kLeaveOut = "none";

// What a word says about a structure. The first that a name contains decides: "femoral artery" is a vessel, "hip
// implant" is metal, and the muscle "levator scapulae" is left out.
enum class Word { nerve, vessel, dura, cartilage, metal, enamel, cortical, cancellous, soft_tissue, left_out, bone };
constexpr std::array<std::optional<LabelKind>, 11> kKindOfWord{
    LabelKind::nerve,       LabelKind::vessel, LabelKind::dura,     LabelKind::cartilage,
    LabelKind::metal,       LabelKind::enamel, LabelKind::cortical, LabelKind::cancellous,
    LabelKind::soft_tissue, std::nullopt,      LabelKind::bone};

struct Words {
  Word word;
  std::span<const std::string_view> list;
};

constexpr std::string_view kNerve[] = {"nerve",  "nerves",   "nervus", "cord",  "medulla",
                                       "plexus", "ganglion", "cauda",  "chorda"};
constexpr std::string_view kVessel[] = {"artery", "arteries", "arteria",   "vein",     "veins",  "vena",
                                        "cava",   "vessel",   "vessels",   "aorta",    "trunk",  "jugular",
                                        "venous", "arterial", "arteriole", "vascular", "carotis"};
constexpr std::string_view kDura[] = {"dura", "dural", "meninges", "meninx", "thecal"};
constexpr std::string_view kCartilage[] = {"cartilage",      "cartilages", "disc",     "discs",  "disk",
                                           "disks",          "meniscus",   "menisci",  "labrum", "chondral",
                                           "fibrocartilage", "discus",     "cartilago"};
constexpr std::string_view kMetal[] = {"metal",    "implant", "implants", "screw", "screws",         "plate",
                                       "plates",   "nail",    "stem",     "wire",  "wires",          "prosthesis",
                                       "hardware", "crown",   "bracket",  "rod",   "rods",           "cage",
                                       "titanium", "cup",     "filling",  "clip",  "endoprosthesis", "bridge"};
constexpr std::string_view kEnamel[] = {"enamel"};
constexpr std::string_view kCortical[] = {"cortical", "cortex", "corticalis", "compacta"};
constexpr std::string_view kCancellous[] = {"cancellous", "trabecular", "spongiosa", "spongious", "spongy", "marrow"};
constexpr std::string_view kSoftTissue[] = {"brain",   "cerebrum", "cerebellum", "brainstem", "eye",      "eyes",
                                            "eyeball", "trachea",  "esophagus",  "pharynx",   "cochlea",  "labyrinth",
                                            "tendon",  "tendons",  "ligament",   "ligaments", "cochleae", "larynx",
                                            "pleura",  "pulp",     "vestibule",  "capsule"};
constexpr std::string_view kLeftOut[] = {
    "spleen",     "kidney",    "kidneys",    "gallbladder", "liver",         "stomach",       "pancreas",
    "gland",      "glands",    "lung",       "lungs",       "lobe",          "thyroid",       "bowel",
    "duodenum",   "colon",     "bladder",    "prostate",    "cyst",          "heart",         "appendage",
    "atrium",     "gluteus",   "autochthon", "iliopsoas",   "muscle",        "muscles",       "face",
    "fat",        "skin",      "tumor",      "tumour",      "levator",       "quadriceps",    "sartorius",
    "deltoid",    "trapezius", "pectoralis", "teres",       "triceps",       "biceps",        "masseter",
    "temporalis", "pterygoid", "background", "air",         "uterus",        "sinus",         "sinuses",
    "tissue",     "tissues",   "body",       "lesion",      "fluid",         "other",         "myocardium",
    "ventricle",  "tongue",    "digastric",  "scalene",     "supraspinatus", "infraspinatus", "subscapularis"};
constexpr std::string_view kBone[] = {
    "bone",       "bones",       "os",         "ossa",       "skull",      "cranium",    "calvaria",   "mandible",
    "mandibula",  "maxilla",     "jaw",        "jaws",       "hyoid",      "vertebra",   "vertebrae",  "spine",
    "sacrum",     "coccyx",      "rib",        "ribs",       "costa",      "sternum",    "manubrium",  "clavicle",
    "clavicula",  "scapula",     "scapulae",   "humerus",    "radius",     "ulna",       "carpal",     "carpals",
    "metacarpal", "metacarpals", "phalanx",    "phalanges",  "scaphoid",   "lunate",     "triquetrum", "pisiform",
    "trapezium",  "trapezoid",   "capitate",   "hamate",     "pelvis",     "hip",        "hips",       "ilium",
    "ischium",    "pubis",       "acetabulum", "femur",      "femora",     "femurs",     "patella",    "tibia",
    "fibula",     "talus",       "calcaneus",  "navicular",  "cuboid",     "cuneiform",  "tarsal",     "tarsals",
    "metatarsal", "metatarsals", "tooth",      "teeth",      "incisor",    "canine",     "premolar",   "molar",
    "zygoma",     "palate",      "atlas",      "axis",       "dens",       "mastoid",    "malleus",    "incus",
    "stapes",     "ossicle",     "ossicles",   "vomer",      "tuberosity", "trochanter", "dentin",     "osseous",
    "condyle",    "olecranon",   "glenoid",    "innominate", "osteophyte", "callus",     "arch",       "jawbone",
    "coxae",      "coxa"};
// Words that say where, which, or of what, and decide nothing.
constexpr std::string_view kPlace[] = {"left",        "right",
                                       "l",           "r",
                                       "both",        "upper",
                                       "lower",       "middle",
                                       "superior",    "inferior",
                                       "anterior",    "posterior",
                                       "medial",      "lateral",
                                       "proximal",    "distal",
                                       "internal",    "external",
                                       "common",      "deep",
                                       "superficial", "great",
                                       "greater",     "lesser",
                                       "major",       "minor",
                                       "maximus",     "medius",
                                       "minimus",     "head",
                                       "neck",        "shaft",
                                       "base",        "process",
                                       "of",          "and",
                                       "the",         "in",
                                       "pulmonary",   "brachiocephalic",
                                       "subclavian",  "carotid",
                                       "iliac",       "femoral",
                                       "femoris",     "temporal",
                                       "frontal",     "parietal",
                                       "occipital",   "zygomatic",
                                       "nasal",       "sphenoid",
                                       "ethmoid",     "facial",
                                       "optic",       "trigeminal",
                                       "alveolar",    "sciatic",
                                       "ulnar",       "radial",
                                       "median",      "spinal",
                                       "articular",   "costal",
                                       "adrenal",     "small",
                                       "large",       "urinary",
                                       "atrial",      "portal",
                                       "splenic",     "structure",
                                       "entire",      "fragment",
                                       "fragments",   "piece",
                                       "part",        "acetabular",
                                       "mandibular",  "maxillary",
                                       "vertebral",   "intervertebral",
                                       "popliteal",   "tibial",
                                       "fibular",     "peroneal",
                                       "brachial",    "axillary",
                                       "humeral",     "dental",
                                       "hard",        "soft",
                                       "hand",        "foot",
                                       "feet",        "hands",
                                       "knee",        "shoulder",
                                       "ankle",       "wrist",
                                       "elbow",       "thyroideum",
                                       "cricoid",     "sacral",
                                       "lumbar",      "thoracic",
                                       "cervical",    "cranial",
                                       "coronary",    "renal",
                                       "meningeal",   "segment",
                                       "label",       "mask",
                                       "basilar",     "cerebral",
                                       "pelvic",      "styloid",
                                       "vestibular",  "cochlear",
                                       "equina",      "mater",
                                       "first",       "second",
                                       "third",       "fourth",
                                       "fifth",       "brachii",
                                       "region",      "cricoid",
                                       "central",     "tympani",
                                       "dexter",      "dextra",
                                       "sinister",    "sinistra",
                                       "femoralis",   "ischiadicus",
                                       "facialis",    "opticus",
                                       "alveolaris",  "mandibularis",
                                       "tibialis",    "fibularis",
                                       "medianus",    "ulnaris",
                                       "radialis",    "spinalis",
                                       "iliaca",      "poplitea",
                                       "vertebralis", "temporale",
                                       "frontale",    "parietale",
                                       "occipitale",  "nasale",
                                       "inferius",    "patellar",
                                       "cruciate",    "collateral"};

constexpr Words kWords[] = {{Word::nerve, kNerve},
                            {Word::vessel, kVessel},
                            {Word::dura, kDura},
                            {Word::cartilage, kCartilage},
                            {Word::metal, kMetal},
                            {Word::enamel, kEnamel},
                            {Word::cortical, kCortical},
                            {Word::cancellous, kCancellous},
                            {Word::soft_tissue, kSoftTissue},
                            {Word::left_out, kLeftOut},
                            {Word::bone, kBone}};

// Names whose words say something else together.
struct WholeName {
  std::string_view name;
  Word word;
};
constexpr WholeName kWholeNames[] = {{"sigmoid sinus", Word::vessel},   {"transverse sinus", Word::vessel},
                                     {"sagittal sinus", Word::vessel},  {"superior sagittal sinus", Word::vessel},
                                     {"venous sinuses", Word::vessel},  {"soft palate", Word::left_out},
                                     {"vertebral body", Word::bone},    {"vertebrae body", Word::bone},
                                     {"zygomatic process", Word::bone}, {"styloid process", Word::bone},
                                     {"femoral head", Word::bone},      {"femoral shaft", Word::bone},
                                     {"humeral head", Word::bone},      {"spinal canal", Word::nerve},
                                     {"mandibular canal", Word::nerve}, {"inferior alveolar canal", Word::nerve},
                                     {"aortic arch", Word::vessel},     {"soft tissue", Word::left_out},
                                     {"tissue", Word::left_out}};

bool all_digits(std::string_view text) {
  return std::ranges::all_of(text, [](unsigned char c) { return std::isdigit(c) != 0; });
}

// A number, a tooth such as fdi11, or a level of the spine such as L1, T12 or C7.
bool is_number(std::string_view word) {
  if (word.starts_with("fdi")) word.remove_prefix(3);
  if (word.size() <= 3 && all_digits(word)) return true;
  return word.size() >= 2 && word.size() <= 3 &&
         std::string_view("ctls").find(word.front()) != std::string_view::npos && all_digits(word.substr(1));
}

std::optional<Word> meaning_of(std::string_view word) {
  for (const Words& words : kWords)
    if (std::ranges::find(words.list, word) != words.list.end()) return words.word;
  return std::nullopt;
}

std::optional<Word> meaning_of(const std::vector<std::string>& words) {
  std::string name;
  for (const std::string& word : words)
    if (word != "left" && word != "right") name += (name.empty() ? "" : " ") + word;
  for (const WholeName& whole : kWholeNames)
    if (whole.name == name) return whole.word;
  std::optional<Word> first;
  for (const std::string& word : words) {
    const std::optional<Word> meaning = meaning_of(word);
    if (!meaning && !is_number(word) && std::ranges::find(kPlace, word) == std::ranges::end(kPlace))
      return std::nullopt;
    if (meaning && (!first || *meaning < *first)) first = meaning;
  }
  return first;
}

// The classes of TotalSegmentator's task "total", version 2, from 1 on, but for vertebrae and ribs, which follow a
// rule.
constexpr std::string_view kFirstClasses[] = {"spleen",
                                              "kidney_right",
                                              "kidney_left",
                                              "gallbladder",
                                              "liver",
                                              "stomach",
                                              "pancreas",
                                              "adrenal_gland_right",
                                              "adrenal_gland_left",
                                              "lung_upper_lobe_left",
                                              "lung_lower_lobe_left",
                                              "lung_upper_lobe_right",
                                              "lung_middle_lobe_right",
                                              "lung_lower_lobe_right",
                                              "esophagus",
                                              "trachea",
                                              "thyroid_gland",
                                              "small_bowel",
                                              "duodenum",
                                              "colon",
                                              "urinary_bladder",
                                              "prostate",
                                              "kidney_cyst_left",
                                              "kidney_cyst_right",
                                              "sacrum",
                                              "vertebrae_S1"};
constexpr int kFirstLumbar = 27, kFirstThoracic = 32, kFirstCervical = 44, kFirstAfterSpine = 51;
constexpr std::string_view kClassesAfterSpine[] = {"heart",
                                                   "aorta",
                                                   "pulmonary_vein",
                                                   "brachiocephalic_trunk",
                                                   "subclavian_artery_right",
                                                   "subclavian_artery_left",
                                                   "common_carotid_artery_right",
                                                   "common_carotid_artery_left",
                                                   "brachiocephalic_vein_left",
                                                   "brachiocephalic_vein_right",
                                                   "atrial_appendage_left",
                                                   "superior_vena_cava",
                                                   "inferior_vena_cava",
                                                   "portal_vein_and_splenic_vein",
                                                   "iliac_artery_left",
                                                   "iliac_artery_right",
                                                   "iliac_vena_left",
                                                   "iliac_vena_right",
                                                   "humerus_left",
                                                   "humerus_right",
                                                   "scapula_left",
                                                   "scapula_right",
                                                   "clavicula_left",
                                                   "clavicula_right",
                                                   "femur_left",
                                                   "femur_right",
                                                   "hip_left",
                                                   "hip_right",
                                                   "spinal_cord",
                                                   "gluteus_maximus_left",
                                                   "gluteus_maximus_right",
                                                   "gluteus_medius_left",
                                                   "gluteus_medius_right",
                                                   "gluteus_minimus_left",
                                                   "gluteus_minimus_right",
                                                   "autochthon_left",
                                                   "autochthon_right",
                                                   "iliopsoas_left",
                                                   "iliopsoas_right",
                                                   "brain",
                                                   "skull"};
constexpr int kFirstLeftRib = 92, kFirstRightRib = 104, kSternum = 116, kCostalCartilages = 117;

std::optional<std::optional<LabelKind>> parse_kind(std::string_view text) {
  if (text == kLeaveOut) return std::optional<LabelKind>();
  for (int kind = 0; kind <= static_cast<int>(LabelKind::soft_tissue); ++kind)
    if (name_of(static_cast<LabelKind>(kind)) == text) return static_cast<LabelKind>(kind);
  return std::nullopt;
}

std::string trimmed(std::string_view text) {
  const std::size_t from = text.find_first_not_of(' ');
  return from == std::string_view::npos ? "" : std::string(text.substr(from, text.find_last_not_of(' ') - from + 1));
}

// One FROM=NAME or FROM=NAME:KIND.
Result<std::pair<std::string, Structure>> parse_name(std::string_view text) {
  const std::string quoted = "--label-names " + bounded_text(text, kMostQuotedName);
  const std::size_t equals = text.find('=');
  const std::string from = trimmed(text.substr(0, equals));
  if (equals == std::string_view::npos || from.empty())
    return bad_input(quoted + " is not " + kTotalSegmentator + " and not a list of names; write NUMBER=NAME, such as " +
                     "1=femur_left,2=femoral_artery");
  Structure structure{trimmed(text.substr(equals + 1)), {}};
  if (const std::size_t colon = structure.name.rfind(':'); colon != std::string::npos) {
    const auto kind = parse_kind(trimmed(std::string_view(structure.name).substr(colon + 1)));
    if (!kind) return bad_input(quoted + " has an unknown kind after the colon; write " + kind_choice_text());
    structure = {trimmed(std::string_view(structure.name).substr(0, colon)), *kind};
  } else if (const auto known = known_structure(structure.name)) {
    structure.kind = known->kind;
  } else {
    return bad_input(quoted + " names no structure that Osteon knows; write NUMBER=NAME:KIND, with the kind " +
                     kind_choice_text());
  }
  if (structure.name.empty() && structure.kind) return bad_input(quoted + " has no name; write NUMBER=NAME");
  if (structure.name.size() > kMostCaseTextBytes / 2 || bounded_text(structure.name) != structure.name)
    return bad_input(quoted + " has a name of more than 100 bytes or with control characters; write a shorter one");
  return std::pair(from, std::move(structure));
}

}  // namespace

bool is_carved(LabelKind kind) {
  return kind == LabelKind::bone || kind == LabelKind::cortical || kind == LabelKind::cancellous ||
         kind == LabelKind::metal || kind == LabelKind::enamel;
}

std::vector<std::string> words_of(std::string_view name) {
  std::vector<std::string> words(1);
  for (const char c : name) {
    const auto letter = static_cast<unsigned char>(c);
    if (std::isalnum(letter) != 0 || letter >= 0x80)
      words.back() += static_cast<char>(std::tolower(letter));
    else if (!words.back().empty())
      words.emplace_back();
  }
  if (words.back().empty()) words.pop_back();
  return words;
}

bool is_tissue_word(std::string_view word) {
  const std::optional<Word> meaning = meaning_of(word);
  return meaning == Word::cortical || meaning == Word::cancellous;
}

std::optional<Structure> known_structure(std::string_view name) {
  if (name.size() > kMostCaseTextBytes / 2) return std::nullopt;
  const std::optional<Word> word = meaning_of(words_of(name));
  if (!word) return std::nullopt;
  return Structure{bounded_text(name), kKindOfWord[static_cast<std::size_t>(*word)]};
}

std::string totalsegmentator_name(int number) {
  const auto at = [&](auto& list, int first) { return std::string(list[static_cast<std::size_t>(number - first)]); };
  const auto counted = [&](const char* name, int last) { return name + std::to_string(last - number); };
  if (number < 1 || number > kCostalCartilages) return "";
  if (number < kFirstLumbar) return at(kFirstClasses, 1);
  if (number < kFirstThoracic) return counted("vertebrae_L", kFirstThoracic);
  if (number < kFirstCervical) return counted("vertebrae_T", kFirstCervical);
  if (number < kFirstAfterSpine) return counted("vertebrae_C", kFirstAfterSpine);
  if (number < kFirstLeftRib) return at(kClassesAfterSpine, kFirstAfterSpine);
  if (number < kFirstRightRib) return "rib_left_" + std::to_string(number - kFirstLeftRib + 1);
  if (number < kSternum) return "rib_right_" + std::to_string(number - kFirstRightRib + 1);
  return number == kSternum ? "sternum" : "costal_cartilages";
}

std::string kind_choice_text() {
  std::string text;
  for (int kind = 0; kind <= static_cast<int>(LabelKind::soft_tissue); ++kind)
    text += std::string(name_of(static_cast<LabelKind>(kind))) + ", ";
  return text.substr(0, text.size() - 2) + " or " + kLeaveOut;
}

Result<LabelNames> parse_label_names(const std::vector<std::string>& texts) {
  LabelNames names;
  for (const std::string& text : texts)
    for (std::size_t begin = 0; begin <= text.size();) {
      const std::size_t end = std::min(text.find(',', begin), text.size());
      const std::string one = trimmed(std::string_view(text).substr(begin, end - begin));
      begin = end + 1;
      if (one == kTotalSegmentator) {
        names.totalsegmentator = true;
        continue;
      }
      auto name = parse_name(one);
      if (!name) return tl::unexpected(name.error());
      if (!names.given.insert(*name).second)
        return bad_input("--label-names gives " + bounded_text(name->first, kMostQuotedName) +
                         " two names; write one of them");
    }
  return names;
}

}  // namespace osteon::import
