#include "haptic_client/device/dynamic_library.hpp"

#include <dlfcn.h>

#include <vector>

namespace osteon::haptic {

Result<DynamicLibrary> DynamicLibrary::load(const LibraryRequest& wanted) {
  std::vector<std::string> names;
  if (!wanted.file.empty()) {
    std::error_code ignored;
    if (!std::filesystem::exists(wanted.file, ignored))
      return failure(ErrorCode::not_found, "there is no file " + wanted.file.string() + " to load " + wanted.what +
                                               " from; correct the path, or " + wanted.remedy);
    // Without a slash the dynamic linker would search elsewhere.
    names.push_back(std::filesystem::absolute(wanted.file).string());
  } else {
    names.assign(wanted.names.begin(), wanted.names.end());
  }
  std::string wrong;
  for (const std::string& name : names) {
    DynamicLibrary library;
    library.handle_ = ::dlopen(name.c_str(), RTLD_NOW | RTLD_LOCAL);
    library.name_ = name;
    if (library.handle_) return library;
    const char* why = ::dlerror();
    const std::string text = why ? why : "it cannot be loaded";
    // The linker says "NAME: cannot open ..." when the library itself is missing. Any other text means that the library
    // is present but something it needs is missing.
    const bool absent = text.starts_with(name + ": cannot open shared object file");
    if (!absent && wrong.empty()) wrong = text;
  }
  if (!wrong.empty())
    return failure(ErrorCode::unsupported, wanted.what + " cannot be loaded (" + wrong + "); " + wanted.remedy);
  std::string tried;
  for (const std::string& name : names) tried += (tried.empty() ? "" : ", ") + name;
  return failure(ErrorCode::not_found, wanted.what + " is not installed (looked for " + tried + "); " + wanted.remedy);
}

void* DynamicLibrary::symbol(const char* name) const noexcept { return ::dlsym(handle_, name); }

}  // namespace osteon::haptic
