"""The modelled lighthouse and the simulated scanner of the demo; nothing in a build imports it."""
