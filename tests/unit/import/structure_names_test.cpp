// Names of structures: TotalSegmentator's, those that people write, and those of people.
#include "server/import/structure_names.hpp"

#include <array>
#include <set>

#include "server/import/nifti_names.hpp"
#include "server/import/slicer_segments.hpp"
#include "tests/unit/import/fixtures.hpp"
#include "tests/unit/import/label_files.hpp"

namespace osteon::import {
namespace {

std::optional<LabelKind> kind_of_name(const std::string& name) {
  const auto structure = known_structure(name);
  EXPECT_TRUE(structure) << name;
  return structure ? structure->kind : std::nullopt;
}

// Names at both ends of each rule, from the map of classes of TotalSegmentator 2.
TEST(StructureNames, NumbersAreThoseOfTotalSegmentator) {
  const std::array<std::pair<int, const char*>, 31> known{{
      {1, "spleen"},
      {15, "esophagus"},
      {24, "kidney_cyst_right"},
      {25, "sacrum"},
      {26, "vertebrae_S1"},
      {27, "vertebrae_L5"},
      {31, "vertebrae_L1"},
      {32, "vertebrae_T12"},
      {43, "vertebrae_T1"},
      {44, "vertebrae_C7"},
      {50, "vertebrae_C1"},
      {51, "heart"},
      {52, "aorta"},
      {61, "atrial_appendage_left"},
      {64, "portal_vein_and_splenic_vein"},
      {68, "iliac_vena_right"},
      {69, "humerus_left"},
      {73, "clavicula_left"},
      {75, "femur_left"},
      {76, "femur_right"},
      {77, "hip_left"},
      {78, "hip_right"},
      {79, "spinal_cord"},
      {90, "brain"},
      {91, "skull"},
      {92, "rib_left_1"},
      {103, "rib_left_12"},
      {104, "rib_right_1"},
      {115, "rib_right_12"},
      {116, "sternum"},
      {117, "costal_cartilages"},
  }};
  for (const auto& [number, name] : known) EXPECT_EQ(totalsegmentator_name(number), name);
  std::set<std::string> names;
  for (int number = 1; number <= 117; ++number) names.insert(totalsegmentator_name(number));
  EXPECT_EQ(names.size(), 117u) << "each has a name of its own";
  for (const int number : {-1, 0, 118, 255}) EXPECT_EQ(totalsegmentator_name(number), "") << number;
}

TEST(StructureNames, TheBonesOfTotalSegmentatorAreCarvedAndItsVesselsAreAtRisk) {
  const auto among = [](int number, std::initializer_list<std::pair<int, int>> ranges) {
    for (const auto& [first, last] : ranges)
      if (number >= first && number <= last) return true;
    return false;
  };
  for (int number = 1; number <= 117; ++number) {
    const std::string name = totalsegmentator_name(number);
    std::optional<LabelKind> kind;
    if (among(number, {{25, 50}, {69, 78}, {91, 116}})) kind = LabelKind::bone;
    if (among(number, {{52, 60}, {62, 68}})) kind = LabelKind::vessel;
    if (number == 79) kind = LabelKind::nerve;
    if (number == 117) kind = LabelKind::cartilage;
    if (among(number, {{15, 16}, {90, 90}})) kind = LabelKind::soft_tissue;
    EXPECT_EQ(kind_of_name(name), kind) << name;
  }
}

TEST(StructureNames, WordsDecideInAnyOrder) {
  EXPECT_EQ(kind_of_name("Left Femur"), LabelKind::bone);
  EXPECT_EQ(kind_of_name("L3 vertebra"), LabelKind::bone);
  EXPECT_EQ(kind_of_name("tibia-fragment 2"), LabelKind::bone);
  EXPECT_EQ(kind_of_name("Cortical bone of the femur"), LabelKind::cortical);
  EXPECT_EQ(kind_of_name("trabecular bone"), LabelKind::cancellous);
  EXPECT_EQ(kind_of_name("Femoral artery, left"), LabelKind::vessel);
  EXPECT_EQ(kind_of_name("Inferior alveolar nerve"), LabelKind::nerve);
  EXPECT_EQ(kind_of_name("dura mater"), LabelKind::dura);
  EXPECT_EQ(kind_of_name("articular cartilage of the knee"), LabelKind::cartilage);
  EXPECT_EQ(kind_of_name("intervertebral_discs"), LabelKind::cartilage);
  EXPECT_EQ(kind_of_name("hip_implant"), LabelKind::metal);
  EXPECT_EQ(kind_of_name("enamel of the first molar"), LabelKind::enamel);
  EXPECT_EQ(kind_of_name("levator_scapulae_left"), std::nullopt) << "a muscle";
  EXPECT_EQ(kind_of_name("Nervus ischiadicus"), LabelKind::nerve);
  EXPECT_EQ(kind_of_name("upper_right_central_incisor_fdi11"), LabelKind::bone);
  EXPECT_EQ(kind_of_name("Left Inferior Alveolar Canal"), LabelKind::nerve);
  EXPECT_EQ(kind_of_name("liver"), std::nullopt);
}

TEST(StructureNames, ANameWithAnUnknownWordIsNotKnown) {
  for (const char* name : {"", "Segment_1", "Femur Jane Doe", "DOE^JANE femur", "label 4", "left", "12", "os\xc3\xa9"})
    EXPECT_FALSE(known_structure(name)) << name;
  EXPECT_FALSE(known_structure(std::string(300, ' ') + "femur"));
}

TEST(StructureNames, ListsGiveNamesAndKinds) {
  const auto names = parse_label_names({"1=femur_left, 2=My guide:metal", "Segment_3=:none", "4 = vein"});
  ASSERT_TRUE(names) << names.error().message;
  EXPECT_FALSE(names->totalsegmentator);
  ASSERT_EQ(names->given.size(), 4u);
  EXPECT_EQ(names->given.at("1").name, "femur_left");
  EXPECT_EQ(names->given.at("1").kind, LabelKind::bone);
  EXPECT_EQ(names->given.at("2").name, "My guide");
  EXPECT_EQ(names->given.at("2").kind, LabelKind::metal);
  EXPECT_FALSE(names->given.at("Segment_3").kind);
  EXPECT_EQ(names->given.at("4").kind, LabelKind::vessel);
  const auto both = parse_label_names({"totalsegmentator,75=left thigh:bone"});
  ASSERT_TRUE(both);
  EXPECT_TRUE(both->totalsegmentator);
  EXPECT_EQ(both->given.at("75").name, "left thigh");
  EXPECT_TRUE(parse_label_names({})->given.empty());
}

TEST(StructureNames, AWrongListIsRefusedInASentence) {
  const auto refused = [](const std::string& text, const std::string& what) {
    const auto names = parse_label_names({text});
    ASSERT_FALSE(names) << text;
    expect_one_sentence(names.error(), what);
    EXPECT_TRUE(names.error().message.starts_with("--label-names ")) << names.error().message;
  };
  refused("", "write NUMBER=NAME");
  refused("TotalSegmentor", "write NUMBER=NAME");
  refused("=femur", "write NUMBER=NAME");
  refused("1=femur,", "write NUMBER=NAME");
  refused("1=Jane Doe", "write NUMBER=NAME:KIND");
  refused("1=thing:stone", "soft_tissue or none");
  refused("1=:bone", "has no name");
  refused("1=femur,1=tibia", "two names");
  refused("1=" + std::string(150, 'a') + ":bone", "100 bytes");
  refused("1=a\nb:bone", "control characters");
}

TEST(SlicerSegments, AreReadFromTheFieldsOfTheHeader) {
  const auto segments =
      slicer_segments({{"Segment1_LabelValue", "7"},
                       {"Segment1_Layer", "2"},
                       {"Segment1_Name", "vein"},
                       {"Segment0_Name", "Segment_1"},
                       {"Segment0_LabelValue", "1"},
                       {"Segment0_Tags",
                        "Segmentation.Status:completed|TerminologyEntry:Segmentation category and type - 3D Slicer "
                        "General Anatomy list~SCT^123037004^Anatomical Structure~SCT^71341001^Femur~SCT^7771000^Left~"
                        "Anatomic codes - DICOM master list~^^~^^|"},
                       {"Segmentation_SourceRepresentation", "Binary labelmap"},
                       {"SegmentX_Name", "nothing"}});
  ASSERT_TRUE(segments) << segments.error().message;
  ASSERT_EQ(segments->size(), 2u);
  EXPECT_EQ((*segments)[0].type, "Femur");
  EXPECT_EQ((*segments)[0].value, 1);
  EXPECT_EQ((*segments)[0].layer, 0);
  EXPECT_EQ((*segments)[1].name, "vein");
  EXPECT_EQ((*segments)[1].value, 7);
  EXPECT_EQ((*segments)[1].layer, 2);
}

TEST(SlicerSegments, WithoutValuesEachSegmentIsALayerOfItsOwn) {
  const auto segments = slicer_segments({{"Segment0_Name", "femur"}, {"Segment1_Name", "vein"}});
  ASSERT_TRUE(segments);
  ASSERT_EQ(segments->size(), 2u);
  EXPECT_EQ((*segments)[1].layer, 1);
  EXPECT_EQ((*segments)[1].value, 1);
}

TEST(SlicerSegments, WrongNumbersAreRefused) {
  for (const auto& [key, value] : HeaderFields{{"Segment0_LabelValue", "-1"},
                                               {"Segment0_LabelValue", "0"},
                                               {"Segment0_LabelValue", "1.5"},
                                               {"Segment0_LabelValue", "70000"},
                                               {"Segment0_Layer", "x"},
                                               {"Segment70000_Name", "a"}})
    EXPECT_FALSE(slicer_segments({{key, value}})) << key << " " << value;
  EXPECT_FALSE(slicer_segments({{"Segment0_LabelValue", "3"}, {"Segment1_LabelValue", "3"}})) << "two of one value";
}

TEST(NiftiNames, AreThoseOfTheLabelTable) {
  const TestGrid grid{.dims = {2, 2, 2}};
  const auto names =
      nifti_label_names(nifti_file(grid, {.bytes = std::string(8, '\0')}, {{75, "femur_left"}, {52, "aorta"}}));
  EXPECT_EQ(names, (std::map<int, std::string>{{52, "aorta"}, {75, "femur_left"}}));
}

TEST(NiftiNames, AHeaderWithoutATableNamesNothing) {
  const TestGrid grid{.dims = {2, 2, 2}};
  EXPECT_TRUE(nifti_label_names("").empty());
  EXPECT_TRUE(nifti_label_names(nifti_file(grid, {.bytes = std::string(8, '\1')})).empty());
  std::string file = nifti_file(grid, {.bytes = std::string(8, '\0')}, {{75, "femur_left"}});
  file[352] = '\xff', file[353] = '\xff', file[354] = '\xff', file[355] = '\x7f';  // a size beyond the file
  EXPECT_TRUE(nifti_label_names(file).empty());
}

}  // namespace
}  // namespace osteon::import
