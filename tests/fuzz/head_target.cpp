// A head for headphones: a SOFA file, that is HDF5 in the form of netCDF, which libmysofa reads.
#include <hdf5.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <initializer_list>
#include <string>
#include <vector>

#include "audio_client/space/sofa_file.hpp"
#include "common/core/check.hpp"
#include "common/recording/hdf5_handle.hpp"
#include "tests/fuzz/import_files.hpp"
#include "tests/fuzz/sound_targets.hpp"

// libmysofa loses some of what it has read when it refuses one of these damaged files. Only here, so that a head that
// Osteon itself loses is found by the other tests.
extern "C" const char* __lsan_default_suppressions() {  // NOLINT(bugprone-reserved-identifier)
  return "leak:libmysofa.so\n";
}

namespace osteon::fuzz {
namespace {

struct HeadCounts {
  long read = 0, refused = 0;
};
HeadCounts head_counts;

void read_any_head(std::span<const std::uint8_t> data) {
  static const InputFile file("head.sofa");
  const auto head = audio::read_hrtf(file.write(data), 48000);
  ++(head ? head_counts.read : head_counts.refused);
  if (!head) return expect_bounded(head.error());
  for (const Vec3& towards : {Vec3(1, 0, 0), Vec3(0, -1, 0), Vec3(0, 0, 1), Vec3(-0.6, 0.64, -0.48)}) {
    audio::EarPair ears;
    head->towards(towards, ears);
    for (const audio::EarResponse* ear : {&ears.left, &ears.right})
      OSTEON_CHECK(std::isfinite(ear->delay_s) &&
                   std::ranges::all_of(ear->filter, [](float x) { return std::isfinite(x); }));
  }
}

// Objects of HDF5 as netCDF makes them. libmysofa reads no others: headers of version 1.8 without times.
class SofaWriter {
 public:
  explicit SofaWriter(const std::filesystem::path& file) {
    const Hdf5Handle create(H5Pcreate(H5P_FILE_CREATE), H5Pclose), access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
    for (const auto order : {H5Pset_link_creation_order, H5Pset_attr_creation_order})
      OSTEON_CHECK(order(create.id(), H5P_CRT_ORDER_TRACKED | H5P_CRT_ORDER_INDEXED) >= 0);
    OSTEON_CHECK(H5Pset_obj_track_times(create.id(), 0) >= 0);
    OSTEON_CHECK(H5Pset_libver_bounds(access.id(), H5F_LIBVER_V18, H5F_LIBVER_V18) >= 0);
    file_ = {H5Fcreate(file.c_str(), H5F_ACC_TRUNC, create.id(), access.id()), H5Fclose};
    OSTEON_CHECK(file_.ok());
  }

  void text(const char* name, const std::string& value) { text(file_.id(), name, value); }

  void dimension(const char* name, hsize_t size) {
    const Hdf5Handle of = dataset(name, H5T_IEEE_F32BE, {size}, false);
    text(of.id(), "CLASS", "DIMENSION_SCALE");
    std::array<char, 11> number{};
    std::snprintf(number.data(), number.size(), "%10d", static_cast<int>(size));
    text(of.id(), "NAME", std::string("This is a netCDF dimension but not a netCDF variable.") + number.data());
  }

  // `over`: the names of its dimensions, one letter each.
  void array(const char* name, const std::string& over, const std::vector<hsize_t>& sizes,
             const std::vector<double>& values, const char* type = nullptr, const char* units = nullptr) {
    const Hdf5Handle of = dataset(name, H5T_IEEE_F64LE, sizes, true);
    OSTEON_CHECK(H5Dwrite(of.id(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) >= 0);
    if (type) text(of.id(), "Type", type);
    if (units) text(of.id(), "Units", units);
    std::vector<hobj_ref_t> scales(over.size());
    std::vector<hvl_t> lists;
    for (std::size_t i = 0; i < over.size(); ++i) {
      OSTEON_CHECK(H5Rcreate(&scales[i], file_.id(), over.substr(i, 1).c_str(), H5R_OBJECT, -1) >= 0);
      lists.push_back({1, &scales[i]});
    }
    const hsize_t rank = over.size();
    const Hdf5Handle list(H5Tvlen_create(H5T_STD_REF_OBJ), H5Tclose);
    const Hdf5Handle space(H5Screate_simple(1, &rank, nullptr), H5Sclose);
    attribute(of.id(), "DIMENSION_LIST", list.id(), space.id(), lists.data());
  }

 private:
  [[nodiscard]] Hdf5Handle dataset(const char* name, hid_t type, const std::vector<hsize_t>& sizes, bool packed) const {
    const Hdf5Handle create(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
    const auto rank = static_cast<int>(sizes.size());
    OSTEON_CHECK(H5Pset_obj_track_times(create.id(), 0) >= 0);
    OSTEON_CHECK(H5Pset_attr_creation_order(create.id(), H5P_CRT_ORDER_TRACKED | H5P_CRT_ORDER_INDEXED) >= 0);
    if (packed)
      OSTEON_CHECK(H5Pset_chunk(create.id(), rank, sizes.data()) >= 0 && H5Pset_shuffle(create.id()) >= 0 &&
                   H5Pset_deflate(create.id(), 4) >= 0);
    const Hdf5Handle space(H5Screate_simple(rank, sizes.data(), nullptr), H5Sclose);
    Hdf5Handle made(H5Dcreate2(file_.id(), name, type, space.id(), H5P_DEFAULT, create.id(), H5P_DEFAULT), H5Dclose);
    OSTEON_CHECK(made.ok());
    return made;
  }

  static void text(hid_t of, const char* name, const std::string& value) {
    const Hdf5Handle type(H5Tcopy(H5T_C_S1), H5Tclose), space(H5Screate(H5S_SCALAR), H5Sclose);
    OSTEON_CHECK(H5Tset_size(type.id(), value.size()) >= 0 && H5Tset_strpad(type.id(), H5T_STR_NULLPAD) >= 0);
    attribute(of, name, type.id(), space.id(), value.data());
  }
  static void attribute(hid_t of, const char* name, hid_t type, hid_t space, const void* value) {
    const Hdf5Handle made(H5Acreate2(of, name, type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
    OSTEON_CHECK(made.ok() && H5Awrite(made.id(), type, value) >= 0);
  }

  Hdf5Handle file_;
};

// Six directions, and responses of eight samples: a blow, and a softer one.
Bytes a_head() {
  const InputFile file("seed.sofa");
  const auto path = file.folder() / "made.sofa";
  constexpr hsize_t kDirections = 6, kSamples = 8;
  {
    SofaWriter sofa(path);
    for (const auto& [name, value] :
         std::initializer_list<std::pair<const char*, const char*>>{{"Conventions", "SOFA"},
                                                                    {"Version", "1.0"},
                                                                    {"SOFAConventions", "SimpleFreeFieldHRIR"},
                                                                    {"SOFAConventionsVersion", "1.0"},
                                                                    {"DataType", "FIR"},
                                                                    {"RoomType", "free field"}})
      sofa.text(name, value);
    for (const auto& [name, size] : std::initializer_list<std::pair<const char*, hsize_t>>{
             {"C", 3}, {"I", 1}, {"M", kDirections}, {"R", 2}, {"E", 1}, {"N", kSamples}})
      sofa.dimension(name, size);
    std::vector<double> responses(kDirections * 2 * kSamples, 0.0);
    for (std::size_t at = 0; at < responses.size(); at += kSamples) responses[at + 2] = 1.0, responses[at + 4] = 0.3;
    sofa.array("Data.IR", "MRN", {kDirections, 2, kSamples}, responses);
    sofa.array("Data.SamplingRate", "I", {1}, {48000}, nullptr, "hertz");
    sofa.array("Data.Delay", "IR", {1, 2}, {0, 0});
    sofa.array("SourcePosition", "MC", {kDirections, 3},
               {0, 0, 1.2, 90, 0, 1.2, 180, 0, 1.2, 270, 0, 1.2, 0, 90, 1.2, 0, -90, 1.2}, "spherical",
               "degree, degree, metre");
    sofa.array("ListenerPosition", "IC", {1, 3}, {0, 0, 0}, "cartesian", "metre");
    sofa.array("ListenerView", "IC", {1, 3}, {1, 0, 0}, "cartesian", "metre");
    sofa.array("ListenerUp", "IC", {1, 3}, {0, 0, 1});
    sofa.array("ReceiverPosition", "RCI", {2, 3, 1}, {0, 0.09, 0, 0, -0.09, 0}, "cartesian", "metre");
    sofa.array("EmitterPosition", "ECI", {1, 3, 1}, {0, 0, 0}, "cartesian", "metre");
  }
  const auto head = audio::read_hrtf(path, 48000);
  OSTEON_CHECK(head.has_value());  // otherwise nothing behind the first check is reached
  return bytes_of_file(path);
}

// Most of the file is zeros between its objects, which nobody reads.
void change_head(Bytes& input, std::mt19937& random) {
  if (input.empty()) return;
  std::size_t at = random() % input.size();
  for (int tries = 0; input[at] == 0 && tries < 64; ++tries) at = random() % input.size();
  at = std::min(at + random() % 3, input.size() - 1);
  input[at] = static_cast<std::uint8_t>(random() % 4 ? random() : 0xFF);
  if (random() % 16 == 0) input.resize(random() % input.size());
}

}  // namespace

Target head_target() {
  Target target{"head", read_any_head, {a_head()}};
  target.mutations = 300;
  target.change = change_head;
  target.figures = [] {
    return "heads read " + std::to_string(head_counts.read) + ", refused " + std::to_string(head_counts.refused);
  };
  return target;
}

}  // namespace osteon::fuzz
