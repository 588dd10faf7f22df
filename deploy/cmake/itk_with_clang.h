// Debian's ITK was configured for GCC, and its itk_compiler_detection.h refuses clang. In files that include ITK, this
// header takes its place and gives clang the macros that ITK's headers use. It does nothing for GCC.
#if defined(__clang__) && !defined(ITK_COMPILER_DETECTION_H)
#define ITK_COMPILER_DETECTION_H
#define ITK_COMPILER_IS_Clang 1
#define ITK_COMPILER_CXX_STATIC_ASSERT 1
#define ITK_CONSTEXPR constexpr
#define ITK_DEPRECATED_MSG(MSG) [[deprecated(MSG)]]
#define ITK_NOEXCEPT noexcept
#endif
