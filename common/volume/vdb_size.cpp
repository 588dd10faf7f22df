#include "common/volume/vdb_size.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/geometry/lattice.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

// The format that OpenVDB 10 writes (openvdb/io/Archive.h, tree/InternalNode.h, io/Compression.h).
constexpr std::int64_t kMagic = 0x56444220;
constexpr std::uint32_t kFormat = 224;
constexpr std::uint64_t kUuidBytes = 36;
constexpr std::uint32_t kNoZip = 0b110;  // Blosc, active values only
constexpr std::uint32_t kBlosc = 0b100, kActiveAlone = 0b010;
constexpr std::uint64_t kScaleMapBytes = 5 * 3 * sizeof(double);
constexpr std::uint32_t kBloscHeaderBytes = 16;
constexpr std::uint32_t kMostMetadata = 4096;      // entries
constexpr std::uint64_t kMostTextBytes = 1 << 20;  // of a name or a value
constexpr std::int32_t kRootChild = 4096;          // samples along a child of the root
constexpr std::int32_t kFarthest = 1 << 23;        // samples
constexpr std::uint64_t kRootEntryBytes = 96;      // of a tile or child in the root's table
constexpr std::uint64_t kLeafNodeBytes = kLeafVoxels * sizeof(float) + 128;
static_assert(sizeof(float) == sizeof(std::int32_t));  // so the same walk fits the grids of both
constexpr std::uint64_t kCaseMemoryBytes = std::uint64_t{768} << 20, kMemoryToFile = 12;

// A fault of a file. Thrown during the walk and caught by measure_vdb().
struct Refusal {
  ErrorCode code;
  std::string what;
};
[[noreturn]] void damaged(std::string what) { throw Refusal{ErrorCode::invalid_input, std::move(what)}; }

// A file's bytes in order. Never reads beyond its end.
class Bytes {
 public:
  explicit Bytes(const fs::path& file) : in_(file, std::ios::binary), end_(fs::file_size(file)), buffer_(kBuffer) {}
  [[nodiscard]] std::uint64_t position() const { return position_; }

  void read(void* to, std::uint64_t count) {
    check(count);
    auto* out = static_cast<char*>(to);
    while (count > 0) {
      if (at_ == filled_) fill();
      const std::size_t part = std::min<std::uint64_t>(count, filled_ - at_);
      std::memcpy(out, buffer_.data() + at_, part);
      out += part;
      at_ += part;
      position_ += part;
      count -= part;
    }
  }
  void skip(std::uint64_t count) {
    check(count);
    position_ += count;
    if (count <= filled_ - at_) {
      at_ += count;
      return;
    }
    at_ = filled_ = 0;
    in_.seekg(static_cast<std::streamoff>(position_));
  }
  template <class T>
  T number() {
    T value{};
    read(&value, sizeof value);
    return value;
  }
  std::string text() {
    const auto size = number<std::uint32_t>();
    if (size > kMostTextBytes) damaged("it has a name of " + std::to_string(size) + " bytes");
    check(size);
    std::string text(size, '\0');
    read(text.data(), size);
    return text;
  }

 private:
  static constexpr std::size_t kBuffer = 1 << 18;
  void check(std::uint64_t count) const {
    if (count > end_ - position_) damaged("it ends in the middle of a grid");
  }
  void fill() {
    in_.read(buffer_.data(), static_cast<std::streamsize>(kBuffer));
    at_ = 0;
    filled_ = static_cast<std::size_t>(in_.gcount());
    in_.clear();
    if (filled_ == 0) damaged("it cannot be read");
  }

  std::ifstream in_;
  const std::uint64_t end_;
  std::uint64_t position_ = 0;
  std::vector<char> buffer_;
  std::size_t at_ = 0, filled_ = 0;
};

// Entries of a kind have one size. OpenVDB reads this many bytes, whatever size the file gives.
std::optional<std::uint32_t> size_of_kind(std::string_view kind) {
  if (kind == "bool") return 1;
  if (kind == "float" || kind == "int32") return 4;
  if (kind == "double" || kind == "int64") return 8;
  if (kind == "vec3i" || kind == "vec3s") return 12;
  if (kind == "vec3d") return 24;
  return std::nullopt;
}

void skip_metadata(Bytes& bytes) {
  const auto entries = bytes.number<std::uint32_t>();
  if (entries > kMostMetadata) damaged("it has " + std::to_string(entries) + " entries of metadata");
  for (std::uint32_t i = 0; i < entries; ++i) {
    (void)bytes.text();
    const std::string kind = bytes.text();
    const auto size = bytes.number<std::uint32_t>();
    // A hint for readers that load a grid gradually. start_openvdb() makes OpenVDB treat it as plain bytes.
    const bool plain = kind == "string" || kind == "__delayedload";
    if (!plain && size_of_kind(kind) != size) damaged("its metadata has an entry of an unknown kind or size");
    bytes.skip(size);
  }
}

// Positions in a node of the tree, from the root's children (2) to the leaves (0).
constexpr std::uint32_t places_of(int level) { return level == 2 ? 1u << 15 : 1u << 12; }

// One grid: the topology first, then the values of all leaves in the same order.
class GridWalk {
 public:
  GridWalk(Bytes& bytes, const VdbLimits& limits, VdbSize& size) : bytes_(bytes), limits_(limits), size_(size) {}

  // `values`: position where the leaves' values begin, from the grid's header.
  void run(std::uint64_t values) {
    compression_ = bytes_.number<std::uint32_t>();
    if ((compression_ & ~kNoZip) != 0) damaged("a grid is compressed in a way that Osteon does not use");
    skip_metadata(bytes_);
    if (bytes_.text() != "UniformScaleMap") damaged("a grid has a transform that Osteon does not use");
    bytes_.skip(kScaleMapBytes);
    if (bytes_.number<std::uint32_t>() != 1) damaged("a grid has more than one tree");
    root();
    if (bytes_.position() != values) damaged("a grid's values are not where its head says");
    for (const std::uint16_t active : leaves_) {
      std::array<std::uint64_t, kLeafVoxels / 64> mask;
      if (active_in(mask) != active) damaged("a leaf has two different masks");
      skip_values(kLeafVoxels, active);
    }
    size_.leaves = std::max(size_.leaves, counted_);
  }

 private:
  using Place = std::array<std::int32_t, 3>;

  void root() {
    bytes_.skip(sizeof(float));  // background
    const auto tiles = bytes_.number<std::uint32_t>(), children = bytes_.number<std::uint32_t>();
    std::optional<Place> before;
    for (std::uint32_t i = 0; i < tiles; ++i) {
      next_place(before);
      bytes_.skip(sizeof(float));
      take(kRootEntryBytes, bytes_.number<std::uint8_t>() != 0 ? std::uint64_t{1} << 27 : 0);
    }
    before.reset();
    for (std::uint32_t i = 0; i < children; ++i) {
      next_place(before);
      take(kRootEntryBytes, 0);
      inner(2);
    }
  }

  // The root's table is written in order. A position that occurs twice would be loaded into memory twice.
  void next_place(std::optional<Place>& before) {
    const auto place = bytes_.number<Place>();
    for (const std::int32_t c : place)
      if (c % kRootChild != 0 || c < -kFarthest || c > kFarthest)
        damaged("a grid has samples farther off than any bone");
    if (before && !(*before < place)) damaged("a grid has the same place twice");
    before = place;
  }

  void inner(int level) {
    const std::uint32_t places = places_of(level);
    std::vector<std::uint64_t> child(places / 64), value(places / 64);
    const std::uint32_t children = active_in(child), active = active_in(value);
    for (std::size_t i = 0; i < child.size(); ++i)
      if ((child[i] & value[i]) != 0) damaged("a grid has a node and a value at the same place");
    take(places * sizeof(std::uint64_t) + places / 4, std::uint64_t{active} * (level == 2 ? places_of(1) : 1));
    skip_values(places, active);
    for (std::uint32_t i = 0; i < children; ++i)
      if (level == 2)
        inner(1);
      else
        leaf();
  }

  void leaf() {
    std::array<std::uint64_t, kLeafVoxels / 64> mask;
    take(kLeafNodeBytes, 1);
    leaves_.push_back(static_cast<std::uint16_t>(active_in(mask)));
  }

  template <class Words>
  std::uint32_t active_in(Words& words) {
    bytes_.read(words.data(), words.size() * sizeof(std::uint64_t));
    int active = 0;
    for (const std::uint64_t word : words) active += std::popcount(word);
    return static_cast<std::uint32_t>(active);
  }

  // The values of a node: which inactive value each position has, followed by the active values.
  void skip_values(std::uint32_t places, std::uint32_t active) {
    constexpr std::uint8_t kOneInactive = 2, kMask = 3, kMaskAndOne = 4, kMaskAndTwo = 5, kAll = 6;
    const auto kind = bytes_.number<std::uint8_t>();
    if (kind > kAll) damaged("a node's values are of an unknown kind");
    if (kind == kOneInactive || kind == kMaskAndOne) bytes_.skip(sizeof(float));
    if (kind == kMaskAndTwo) bytes_.skip(2 * sizeof(float));
    if (kind >= kMask && kind <= kMaskAndTwo) bytes_.skip(places / 8);
    const bool some = (compression_ & kActiveAlone) != 0 && kind != kAll;
    skip_packed((some ? active : places) * sizeof(float));
  }

  // `unpacked`: number of bytes that OpenVDB will unpack them into. It trusts the length that the file gives.
  void skip_packed(std::uint64_t unpacked) {
    if ((compression_ & kBlosc) == 0) return bytes_.skip(unpacked);
    const auto length = bytes_.number<std::int64_t>();
    if (length <= 0) {
      if (length != -static_cast<std::int64_t>(unpacked)) damaged("a node has more or fewer values than places");
      return bytes_.skip(unpacked);
    }
    const auto packed = static_cast<std::uint64_t>(length);
    if (packed < kBloscHeaderBytes || packed > unpacked + kBloscHeaderBytes)
      damaged("a node's values have an impossible length");
    bytes_.skip(4);  // versions, flags, size of a value
    const auto whole = bytes_.number<std::uint32_t>(), block = bytes_.number<std::uint32_t>(),
               said = bytes_.number<std::uint32_t>();
    if (whole != unpacked || said != packed || block == 0 || block > std::max<std::uint64_t>(unpacked, 1))
      damaged("a node's values have an impossible length");
    bytes_.skip(packed - kBloscHeaderBytes);
  }

  void take(std::uint64_t memory, std::uint64_t leaves) {
    size_.memory_bytes += memory;
    counted_ += leaves;
    if (size_.memory_bytes > limits_.memory_bytes)
      throw Refusal{ErrorCode::exhausted,
                    "it would take more than " + std::to_string(limits_.memory_bytes >> 20) + " MiB of memory"};
    if (counted_ > limits_.leaves)
      throw Refusal{ErrorCode::exhausted, "a grid of it is larger than any bone: it has more than " +
                                              std::to_string(limits_.leaves) + " leaves"};
  }

  Bytes& bytes_;
  const VdbLimits& limits_;
  VdbSize& size_;
  std::uint32_t compression_ = 0;
  std::uint64_t counted_ = 0;
  std::vector<std::uint16_t> leaves_;  // number of active values of each leaf
};

VdbSize walk(const fs::path& file, const VdbLimits& limits, VdbValues values_of_grids) {
  const bool floats = values_of_grids == VdbValues::floats;
  Bytes bytes(file);
  if (bytes.number<std::int64_t>() != kMagic) damaged("it does not begin as one does");
  if (bytes.number<std::uint32_t>() != kFormat) damaged("its format is another than " + std::to_string(kFormat));
  bytes.skip(2 * sizeof(std::uint32_t));  // version of the library
  if (bytes.number<std::uint8_t>() != 1) damaged("it does not say where its grids are");
  bytes.skip(kUuidBytes);
  skip_metadata(bytes);
  const auto grids = bytes.number<std::uint32_t>();
  if (grids > limits.grids)
    throw Refusal{ErrorCode::exhausted,
                  "it has " + std::to_string(grids) + " grids and may have " + std::to_string(limits.grids)};
  VdbSize size;
  for (std::uint32_t i = 0; i < grids; ++i) {
    (void)bytes.text();  // name
    if (bytes.text() != (floats ? "Tree_float_5_4_3" : "Tree_int32_5_4_3"))
      damaged(std::string("it has a grid that is not one of ") + (floats ? "float" : "int32"));
    if (!bytes.text().empty()) damaged("it has a grid that is another one's");
    const auto first = bytes.number<std::uint64_t>(), values = bytes.number<std::uint64_t>(),
               end = bytes.number<std::uint64_t>();
    if (first != bytes.position()) damaged("its grids are not one behind the other");
    GridWalk(bytes, limits, size).run(values);
    if (bytes.position() != end) damaged("its grids are not one behind the other");
  }
  return size;
}

}  // namespace

Result<VdbSize> measure_vdb(const fs::path& file, const VdbLimits& limits, VdbValues values) {
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return failure(ErrorCode::not_found, "there is no file " + file.string());
  try {
    return walk(file, limits, values);
  } catch (const Refusal& refusal) {
    const char* verdict =
        refusal.code == ErrorCode::exhausted ? " is too large: " : " is damaged or not a .vdb file of Osteon: ";
    return failure(refusal.code, file.string() + verdict + refusal.what);
  } catch (const std::exception& e) {
    return failure(ErrorCode::invalid_input, file.string() + " cannot be read: " + e.what());
  }
}

std::uint64_t most_case_memory(const fs::path& file) {
  std::error_code error;
  const std::uintmax_t bytes = fs::file_size(file, error);
  return error ? kCaseMemoryBytes : std::max<std::uint64_t>(kCaseMemoryBytes, kMemoryToFile * bytes);
}

}  // namespace osteon
