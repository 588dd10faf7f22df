#include "server/import/nifti_names.hpp"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <pugixml.hpp>

namespace osteon::import {
namespace {

constexpr std::size_t kVoxelsStart = 108, kExtensionMark = 348, kFirstExtension = 352;  // bytes, of nifti1.h
constexpr std::size_t kExtensionStart = 8;  // its size and its code come first
constexpr std::size_t kMostLabelNames = 65536;

void add_names(std::string_view content, std::map<int, std::string>& names) {
  const std::size_t end = content.find_last_of('>');  // padding follows
  pugi::xml_document document;
  if (end == std::string_view::npos || !document.load_buffer(content.data(), end + 1)) return;
  for (const pugi::xpath_node found : document.select_nodes("/CaretExtension/VolumeInformation/LabelTable/Label"))
    if (const int number = found.node().attribute("Key").as_int(); number > 0 && names.size() < kMostLabelNames)
      names[number] = found.node().text().get();
}

}  // namespace

std::map<int, std::string> nifti_label_names(std::string_view head) {
  std::map<int, std::string> names;
  if (head.size() < kFirstExtension || head[kExtensionMark] == 0) return names;
  float voxels_start = 0;
  std::memcpy(&voxels_start, head.data() + kVoxelsStart, sizeof voxels_start);
  if (voxels_start >= static_cast<float>(kFirstExtension) && voxels_start < static_cast<float>(head.size()))
    head = head.substr(0, static_cast<std::size_t>(voxels_start));
  for (std::size_t at = kFirstExtension; at + kExtensionStart <= head.size();) {
    std::int32_t size = 0;
    std::memcpy(&size, head.data() + at, sizeof size);
    if (size < static_cast<std::int32_t>(kExtensionStart) || static_cast<std::size_t>(size) > head.size() - at) break;
    add_names(head.substr(at + kExtensionStart, static_cast<std::size_t>(size) - kExtensionStart), names);
    at += static_cast<std::size_t>(size);
  }
  return names;
}

}  // namespace osteon::import
