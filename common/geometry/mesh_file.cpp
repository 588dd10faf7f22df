#include "common/geometry/mesh_file.hpp"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <numeric>
#include <string>
#include <string_view>

#include <unistd.h>

namespace osteon {
namespace {

static_assert(std::endian::native == std::endian::little, "binary STL and PLY are written as they lie in memory");

namespace fs = std::filesystem;
using Point = std::array<float, 3>;

constexpr std::size_t kHeader = 84, kFacet = 50;  // bytes of a binary STL's header and of each triangle
constexpr std::size_t kMostTriangles = 100'000'000;

tl::unexpected<Error> bad(const fs::path& file, const std::string& what) {
  return failure(ErrorCode::invalid_input, file.string() + " " + what);
}

bool finite(const std::vector<Point>& corners) {
  return std::ranges::all_of(
      corners, [](const Point& p) { return std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]); });
}

std::vector<Point> binary_corners(std::string_view bytes, std::size_t count) {
  std::vector<Point> corners(3 * count);
  for (std::size_t i = 0; i < count; ++i)
    // Skips the normal, which follows from the corners.
    std::memcpy(&corners[3 * i], bytes.data() + kHeader + i * kFacet + 12, 36);
  return corners;
}

// Words of an ASCII STL.
class Words {
 public:
  explicit Words(std::string_view text) : text_(text) {}
  std::string_view next() {
    constexpr std::string_view kBlank = " \t\r\n\v\f";
    const std::size_t from = std::min(text_.find_first_not_of(kBlank, at_), text_.size());
    const std::size_t to = std::min(text_.find_first_of(kBlank, from), text_.size());
    at_ = to;
    return text_.substr(from, to - from);
  }
  void skip_line() { at_ = std::min(text_.find('\n', at_), text_.size()); }
  [[nodiscard]] std::size_t line() const {
    return 1 +
           static_cast<std::size_t>(std::count(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(at_), '\n'));
  }

 private:
  std::string_view text_;
  std::size_t at_ = 0;
};

// False if a word is not a number. `inf` and `nan` count as numbers here and are rejected later.
bool read_point(Words& words, Point& p) {
  for (float& value : p) {
    std::string_view word = words.next();
    if (word.starts_with('+')) word.remove_prefix(1);
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (word.empty() || end != word.data() + word.size()) return false;
    if (error == std::errc::result_out_of_range)
      value = std::numeric_limits<float>::infinity();
    else if (error != std::errc())
      return false;
  }
  return true;
}

Result<std::vector<Point>> ascii_corners(std::string_view text, const fs::path& file) {
  std::vector<Point> corners;
  Words words(text);
  const auto fault = [&](const std::string& what) {
    return bad(file,
               "is not a whole ASCII STL: line " + std::to_string(words.line()) + " " + what + "; export it again");
  };
  words.skip_line();  // "solid" and its name
  for (std::string_view word = words.next(); word != "endsolid"; word = words.next()) {
    if (word.empty()) return fault("ends without \"endsolid\"");
    Point normal;
    if (word != "facet" || words.next() != "normal" || !read_point(words, normal))
      return fault("should begin a facet with its normal");
    if (words.next() != "outer" || words.next() != "loop") return fault("should be \"outer loop\"");
    for (int k = 0; k < 3; ++k) {
      Point p;
      if (words.next() != "vertex" || !read_point(words, p)) return fault("should be a vertex with three numbers");
      corners.push_back(p);
    }
    if (words.next() != "endloop" || words.next() != "endfacet")
      return fault("should end the facet after three vertices");
  }
  return corners;
}

TriangleMesh welded(std::vector<Point> corners) {
  for (Point& p : corners)
    for (float& value : p) value += 0.0f;  // −0 and 0 are the same position
  std::vector<std::uint32_t> order(corners.size()), vertex(corners.size());
  std::iota(order.begin(), order.end(), 0u);
  // By position, then by first use, so that vertices keep the order of the file.
  std::ranges::sort(order, [&](std::uint32_t a, std::uint32_t b) {
    return corners[a] != corners[b] ? corners[a] < corners[b] : a < b;
  });
  std::vector<std::uint32_t> first(corners.size());
  for (std::size_t i = 0; i < order.size(); ++i)
    first[order[i]] = i > 0 && corners[order[i]] == corners[order[i - 1]] ? first[order[i - 1]] : order[i];
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < corners.size(); ++i) {
    if (first[i] == i) {
      vertex[i] = static_cast<std::uint32_t>(mesh.positions_mm.size());
      mesh.positions_mm.push_back(corners[i]);
    } else {
      vertex[i] = vertex[first[i]];
    }
  }
  for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
    const std::array<std::uint32_t, 3> t{vertex[i], vertex[i + 1], vertex[i + 2]};
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) mesh.triangles.push_back(t);
  }
  return mesh;
}

template <class T>
void append(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

void append_number(std::string& text, float value) {
  std::array<char, 32> digits{};
  text.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr);
}

// Written under another name first and then renamed, so that nobody reads an incomplete file.
Result<void> write_whole(const fs::path& file, const std::string& bytes) {
  fs::path partial = file;
  partial += ".part" + std::to_string(::getpid());
  std::error_code error;
  {
    std::ofstream stream(partial, std::ios::binary | std::ios::trunc);
    stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    stream.flush();
    if (!stream) {
      fs::remove(partial, error);
      return failure(ErrorCode::unavailable,
                     file.string() + " cannot be written; check its folder and the space on the disk");
    }
  }
  fs::rename(partial, file, error);
  if (error) {
    std::error_code ignored;
    fs::remove(partial, ignored);
    return failure(ErrorCode::unavailable,
                   file.string() + " cannot be written (" + error.message() + "); choose another name");
  }
  return {};
}

}  // namespace

Result<TriangleMesh> read_stl(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream || fs::is_directory(file))
    return failure(ErrorCode::not_found, file.string() + " cannot be opened; give the path of an STL file");
  const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  if (stream.bad()) return failure(ErrorCode::unavailable, file.string() + " cannot be read; check its permissions");
  if (bytes.empty()) return bad(file, "is empty; export the mesh again");

  std::uint32_t count = 0;
  if (bytes.size() >= kHeader) std::memcpy(&count, bytes.data() + 80, 4);
  // Some binary files begin with "solid" too, so the length decides first.
  const bool binary = bytes.size() >= kHeader && count <= kMostTriangles && bytes.size() == kHeader + count * kFacet;
  std::vector<Point> corners;
  if (binary) {
    corners = binary_corners(bytes, count);
  } else if (bytes.starts_with("solid")) {
    auto read = ascii_corners(bytes, file);
    if (!read) return tl::unexpected(read.error());
    corners = std::move(*read);
  } else if (bytes.size() >= kHeader && count > 0 && count <= kMostTriangles &&
             bytes.size() < kHeader + count * kFacet && bytes.size() > kHeader) {
    return bad(file, "is cut off: it should have " + std::to_string(count) + " triangles and has " +
                         std::to_string((bytes.size() - kHeader) / kFacet) + "; copy or export it again");
  } else {
    return bad(file, "is not an STL file; export the mesh as STL");
  }
  if (!finite(corners)) return bad(file, "has a vertex that is not a number; repair the mesh and export it again");
  TriangleMesh mesh = welded(std::move(corners));
  if (mesh.triangles.empty()) return bad(file, "has no triangles; export the mesh again");
  return mesh;
}

Result<void> write_stl(const TriangleMesh& mesh, const fs::path& file) {
  std::string bytes = "Osteon, millimetres";
  bytes.resize(80, ' ');
  bytes.reserve(kHeader + kFacet * mesh.triangles.size());
  append(bytes, static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vec3 across = (position(mesh, b) - position(mesh, a)).cross(position(mesh, c) - position(mesh, a));
    const double length = across.norm();
    for (int k = 0; k < 3; ++k) append(bytes, static_cast<float>(length > 0.0 ? across[k] / length : 0.0));
    for (const std::uint32_t corner : {a, b, c}) append(bytes, mesh.positions_mm[corner]);
    append(bytes, std::uint16_t{0});
  }
  return write_whole(file, bytes);
}

Result<void> write_ply(const TriangleMesh& mesh, const fs::path& file) {
  const bool normals = !mesh.normals.empty();
  std::string bytes = "ply\nformat binary_little_endian 1.0\ncomment Osteon, millimetres\nelement vertex " +
                      std::to_string(mesh.positions_mm.size()) +
                      "\nproperty float x\nproperty float y\nproperty float z\n";
  if (normals) bytes += "property float nx\nproperty float ny\nproperty float nz\n";
  bytes += "element face " + std::to_string(mesh.triangles.size()) +
           "\nproperty list uchar int vertex_indices\nend_header\n";
  for (std::size_t i = 0; i < mesh.positions_mm.size(); ++i) {
    append(bytes, mesh.positions_mm[i]);
    if (normals) append(bytes, mesh.normals[i]);
  }
  for (const auto& triangle : mesh.triangles) {
    append(bytes, std::uint8_t{3});
    append(bytes, triangle);
  }
  return write_whole(file, bytes);
}

Result<void> write_obj(const TriangleMesh& mesh, const fs::path& file) {
  std::string text = "# Osteon, millimetres\n";
  const auto add_line = [&](std::string_view key, const Point& p) {
    text += key;
    for (const float value : p) {
      text += ' ';
      append_number(text, value);
    }
    text += '\n';
  };
  for (const Point& p : mesh.positions_mm) add_line("v", p);
  for (const Point& n : mesh.normals) add_line("vn", n);
  for (const auto& triangle : mesh.triangles) {
    text += 'f';
    for (const std::uint32_t vertex : triangle) {
      const std::string number = std::to_string(vertex + 1);
      text += ' ' + number;
      if (!mesh.normals.empty()) text += "//" + number;
    }
    text += '\n';
  }
  return write_whole(file, text);
}

Result<void> write_mesh(const TriangleMesh& mesh, const fs::path& file) {
  const std::string ending = file.extension().string();
  if (ending == ".stl") return write_stl(mesh, file);
  if (ending == ".ply") return write_ply(mesh, file);
  if (ending == ".obj") return write_obj(mesh, file);
  return failure(ErrorCode::invalid_input,
                 file.string() + " has an ending that no mesh is written in; choose .stl, .ply or .obj");
}

}  // namespace osteon
