// A vendor's library. It is loaded when it is needed and never unloaded: some of them cannot be loaded twice.
#pragma once
#include <filesystem>
#include <map>
#include <span>
#include <string>

#include "common/core/mutex.hpp"
#include "common/core/result.hpp"

namespace osteon::haptic {

// How to search for a library, and the remedy for a user who does not have it.
struct LibraryRequest {
  std::string what;                    // e.g. "OpenHaptics"
  std::filesystem::path file;          // given by the user; empty: `names` are tried in order
  std::span<const char* const> names;  // as the dynamic linker knows them
  std::string remedy;                  // e.g. "install the vendor's OpenHaptics for Linux"
};

class DynamicLibrary {
 public:
  DynamicLibrary() = default;
  // Errors: not_found (no such library); unsupported (the file is no library for this machine, or needs a library that
  // is missing). The errors are sentences with the remedy.
  [[nodiscard]] static Result<DynamicLibrary> load(const LibraryRequest& wanted);

  // Sets `function` to a function of the library; returns false if it has none of that name.
  template <class F>
  [[nodiscard]] bool find(const char* name, F*& function) const noexcept {
    function = reinterpret_cast<F*>(symbol(name));
    return function != nullptr;
  }
  [[nodiscard]] const std::string& name() const noexcept { return name_; }

 private:
  [[nodiscard]] void* symbol(const char* name) const noexcept;
  void* handle_ = nullptr;  // never closed
  std::string name_;
};

// A vendor's library and its functions.
template <class Api>
struct VendorLibrary {
  DynamicLibrary library;
  Api call{};
};

// Loads the library once for the process. `bind(call, need)` requests each function: need("its name", call.member).
// Errors: those of DynamicLibrary::load; unsupported (it is another library than the one named by `is_not`).
template <class Api, class Bind>
[[nodiscard]] Result<const VendorLibrary<Api>*> load_vendor(const LibraryRequest& wanted, const std::string& is_not,
                                                            Bind bind) {
  static Mutex mutex{LockRank::leaf};                                 // of `loaded`; clang checks no locals
  static std::map<std::filesystem::path, VendorLibrary<Api>> loaded;  // nodes keep their addresses
  const MutexLock lock(mutex);
  if (const auto known = loaded.find(wanted.file); known != loaded.end()) return &known->second;
  Result<DynamicLibrary> library = DynamicLibrary::load(wanted);
  if (!library) return tl::unexpected(library.error());
  VendorLibrary<Api> result{*library, {}};
  const char* missing = nullptr;
  bind(result.call, [&](const char* name, auto& function) {
    if (!result.library.find(name, function) && !missing) missing = name;
  });
  if (missing)
    return failure(ErrorCode::unsupported,
                   library->name() + " is not " + is_not + ": it has no " + missing + "; " + wanted.remedy);
  return &(loaded[wanted.file] = result);
}

}  // namespace osteon::haptic
