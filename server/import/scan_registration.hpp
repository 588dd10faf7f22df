// Registers two scans of one patient: by landmarks, then by mutual information.
#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "common/imaging/rigid_registration.hpp"
#include "server/import/landmark_file.hpp"

namespace osteon::import {

// Where the search began.
enum class RegistrationStart {
  landmarks,    // the landmarks' best fit
  as_they_lie,  // in one patient frame
  centres,      // the middles of both scans on each other
  bone,         // the centres of mass of their bone on each other
};
[[nodiscard]] std::string_view name_of(RegistrationStart start);

struct LandmarkResidual {
  std::string name;           // never stored
  double at_start_mm = 0.0;   // after the best fit of the landmarks
  double at_result_mm = 0.0;  // after the search
};

struct ScanRegistration {
  RegistrationStart start = RegistrationStart::landmarks;
  imaging::RigidRegistration found;
  std::vector<LandmarkResidual> landmarks;  // in their order; empty without landmarks
  std::vector<std::string> warnings;        // one sentence each; they name landmarks by their number alone
};

// Without landmarks, the other starts are tried as far as the scans have them; one frame wins over equally good ones.
// `landmark_file`: for errors. Errors: those of fit_landmarks() and register_rigidly(), and invalid_input for a
// landmark outside its scan.
[[nodiscard]] Result<ScanRegistration> register_scans(const imaging::HuVolume& fixed, const imaging::HuVolume& moving,
                                                      const std::vector<NamedLandmark>& landmarks,
                                                      const std::string& landmark_file, const KeepGoing& keep_going);

// What was found, as lines for a person.
[[nodiscard]] std::string registration_text(const ScanRegistration& registration);

}  // namespace osteon::import
