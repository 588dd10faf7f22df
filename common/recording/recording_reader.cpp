#include "common/recording/recording_reader.hpp"

#include <hdf5.h>

#include <cmath>

#include "common/recording/hdf5_type.hpp"

namespace osteon {

RecordingReader::RecordingReader(const std::filesystem::path& file)
    : path_(file), name_("the recording " + file.string()) {}

bool RecordingReader::open() {
  if (!open_file()) return false;
  if (!has(recording::kFormatName) || text(".", recording::kFormatName) != recording::kFormat)
    return wrong(ErrorCode::invalid_input,
                 path_.string() + " is HDF5, but no recording of Osteon; give one that --record wrote");
  const int version = static_cast<int>(number(".", recording::kVersionName));
  if (ok() && version != recording::kVersion)
    return wrong(ErrorCode::unsupported, name_ + " is of version " + std::to_string(version) +
                                             " of the format; this program reads version " +
                                             std::to_string(recording::kVersion));
  return ok();
}

bool RecordingReader::open_file() {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  std::error_code none;
  if (!std::filesystem::is_regular_file(path_, none))
    return wrong(ErrorCode::not_found, "there is no file " + path_.string() + "; give one that --record wrote");
  if (H5Fis_hdf5(path_.c_str()) <= 0)
    return wrong(ErrorCode::invalid_input, path_.string() + " is not an HDF5 file; give one that --record wrote");
  // A file that is being written, or whose writer was killed, opens only in this mode. A file of another program
  // perhaps opens only in the other mode.
  // In this mode HDF5 reads a part with a wrong checksum again, because a writer may just have changed it. It waits
  // 1 ns, and each time twice as long. Its own limit of 100 attempts never ends in a damaged file; 24 take 17 ms.
  constexpr unsigned kAttempts = 24;
  const Hdf5Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_metadata_read_attempts(access.id(), kAttempts);
  file_ = Hdf5Handle(H5Fopen(path_.c_str(), H5F_ACC_RDONLY | H5F_ACC_SWMR_READ, access.id()), H5Fclose);
  if (!file_.ok()) file_ = Hdf5Handle(H5Fopen(path_.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  if (!file_.ok())
    return wrong(ErrorCode::invalid_input, name_ +
                                               " cannot be opened: it is damaged, or another program has it open; "
                                               "close that program, or give another recording");
  return true;
}

std::string RecordingReader::text(const char* group, const char* name) {
  const Hdf5Handle attribute = find(group, name);
  if (!attribute.ok()) return {};
  const Hdf5Handle type(H5Aget_type(attribute.id()), H5Tclose);
  if (H5Tget_class(type.id()) != H5T_STRING || H5Tis_variable_str(type.id()) <= 0) {
    wrong(ErrorCode::invalid_input, name_ + ": the attribute \"" + name + "\" is not a text");
    return {};
  }
  char* read = nullptr;
  if (H5Aread(attribute.id(), type.id(), &read) < 0 || !read) {
    damaged(name);
    return {};
  }
  std::string value = read;
  H5free_memory(read);
  return value;
}

double RecordingReader::number(const char* group, const char* name) {
  const Hdf5Handle attribute = find(group, name);
  double value = 0.0;
  if (attribute.ok() && (H5Aread(attribute.id(), H5T_NATIVE_DOUBLE, &value) < 0 || !std::isfinite(value)))
    damaged(name);
  return value;
}

bool RecordingReader::has(const char* name, const char* group) const {
  return H5Aexists_by_name(file_.id(), group, name, H5P_DEFAULT) > 0;
}

bool RecordingReader::has_dataset(const char* path) const {
  return H5Oexists_by_name(file_.id(), path, H5P_DEFAULT) > 0;
}

std::vector<std::string> RecordingReader::texts(const char* path) {
  const Hdf5Handle dataset = find_dataset(path);
  if (!dataset.ok()) return {};
  const Hdf5Handle space(H5Dget_space(dataset.id()), H5Sclose), type(H5Dget_type(dataset.id()), H5Tclose);
  const hssize_t count = H5Sget_simple_extent_npoints(space.id());
  const std::size_t size = H5Tget_size(type.id());
  constexpr hssize_t kMostTexts = 10'000;
  if (H5Tget_class(type.id()) != H5T_STRING || H5Tis_variable_str(type.id()) != 0 || count < 0 || count > kMostTexts ||
      size == 0 || size > 4096) {
    wrong(ErrorCode::invalid_input, name_ + ": the dataset \"" + path + "\" is not a list of texts");
    return {};
  }
  std::string all(static_cast<std::size_t>(count) * size, '\0');
  if (count > 0 && H5Dread(dataset.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, all.data()) < 0) {
    damaged(path);
    return {};
  }
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i)
    texts.emplace_back(std::string(all.substr(i * size, size).c_str()));
  return texts;
}

std::string RecordingReader::digits(const char* path) const {
  const Hdf5Handle dataset(H5Dopen2(file_.id(), path, H5P_DEFAULT), H5Dclose), type(H5Tcopy(H5T_C_S1), H5Tclose);
  char digits[65] = {};
  H5Tset_size(type.id(), 64);
  H5Tset_strpad(type.id(), H5T_STR_NULLPAD);
  H5Tset_cset(type.id(), H5T_CSET_UTF8);
  if (!dataset.ok() || H5Dread(dataset.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, digits) < 0) return {};
  return digits;
}

std::size_t RecordingReader::rows(const char* path) {
  const Hdf5Handle dataset = find_dataset(path);
  if (!dataset.ok()) return 0;
  const Hdf5Handle space(H5Dget_space(dataset.id()), H5Sclose);
  const hssize_t count = H5Sget_simple_extent_npoints(space.id());
  return count > 0 ? static_cast<std::size_t>(count) : 0;
}

template <class T>
std::vector<T> RecordingReader::values(const char* path, std::size_t rows, std::size_t width, std::size_t first) {
  const Hdf5Handle dataset = find_dataset(path);
  if (!dataset.ok()) return {};
  const Hdf5Handle space(H5Dget_space(dataset.id()), H5Sclose), stored(H5Dget_type(dataset.id()), H5Tclose);
  hsize_t size[2] = {0, 1};
  const int rank = H5Sget_simple_extent_ndims(space.id());
  if (rank < 1 || rank > 2 || H5Sget_simple_extent_dims(space.id(), size, nullptr) != rank || size[1] != width) {
    wrong(ErrorCode::invalid_input,
          name_ + ": the dataset \"" + path + "\" has not " + std::to_string(width) + " values in a row");
    return {};
  }
  if (size[0] < first + rows) {
    wrong(ErrorCode::invalid_input,
          name_ + ": the dataset \"" + path + "\" has fewer rows than \"" + recording::kTime + "\"");
    return {};
  }
  const hsize_t from[] = {first, 0}, count[] = {rows, width};
  const Hdf5Handle memory(H5Screate_simple(rank, count, nullptr), H5Sclose);
  // Enumerations are stored as small integers with names; here they are read as integers.
  const bool named = H5Tget_class(stored.id()) == H5T_ENUM;
  if (named && H5Tget_size(stored.id()) != sizeof(T)) {
    damaged(path);
    return {};
  }
  std::vector<T> read(rows * width);
  if (H5Sselect_hyperslab(space.id(), H5S_SELECT_SET, from, nullptr, count, nullptr) < 0 ||
      H5Dread(dataset.id(), named ? stored.id() : hdf5_type<T>(), memory.id(), space.id(), H5P_DEFAULT, read.data()) <
          0)
    damaged(path);
  return read;
}

std::optional<std::uint8_t> RecordingReader::enumerator(const char* path, const char* name) {
  const Hdf5Handle dataset = find_dataset(path);
  if (!dataset.ok()) return {};
  const Hdf5Handle type(H5Dget_type(dataset.id()), H5Tclose);
  std::uint8_t value = 0;
  if (H5Tget_class(type.id()) != H5T_ENUM || H5Tget_size(type.id()) != sizeof value ||
      H5Tenum_valueof(type.id(), name, &value) < 0) {
    damaged(path);
    return {};
  }
  return value;
}

bool RecordingReader::wrong(ErrorCode code, const std::string& sentence) {
  if (!error_) error_ = Error{code, sentence};
  return false;
}

bool RecordingReader::damaged(const char* what) {
  return wrong(ErrorCode::invalid_input, name_ + ": \"" + what + "\" cannot be read; the file is damaged");
}

Hdf5Handle RecordingReader::find(const char* group, const char* name) {
  Hdf5Handle attribute(H5Aopen_by_name(file_.id(), group, name, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  if (!attribute.ok())
    wrong(ErrorCode::invalid_input,
          name_ + " has no attribute \"" + name + "\" of \"" + group + "\"; it is not what --record writes");
  return attribute;
}

Hdf5Handle RecordingReader::find_dataset(const char* path) {
  Hdf5Handle dataset(H5Dopen2(file_.id(), path, H5P_DEFAULT), H5Dclose);
  if (!dataset.ok())
    wrong(ErrorCode::invalid_input, name_ + " has no dataset \"" + path + "\"; it is not what --record writes");
  return dataset;
}

template std::vector<double> RecordingReader::values(const char*, std::size_t, std::size_t, std::size_t);
template std::vector<float> RecordingReader::values(const char*, std::size_t, std::size_t, std::size_t);
template std::vector<std::uint8_t> RecordingReader::values(const char*, std::size_t, std::size_t, std::size_t);
template std::vector<std::uint32_t> RecordingReader::values(const char*, std::size_t, std::size_t, std::size_t);
template std::vector<std::uint64_t> RecordingReader::values(const char*, std::size_t, std::size_t, std::size_t);
template std::vector<std::int64_t> RecordingReader::values(const char*, std::size_t, std::size_t, std::size_t);

}  // namespace osteon
