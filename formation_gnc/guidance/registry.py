"""All formations by name: a new formation is one file and one line here."""

from formation_gnc.guidance.formation import Formation
from formation_gnc.guidance.leader_follower import LeaderFollower
from formation_gnc.guidance.relative_orbit import RelativeOrbit

FORMATIONS: dict[str, type[Formation]] = {
    "leader_follower": LeaderFollower,
    "relative_orbit": RelativeOrbit,
}
