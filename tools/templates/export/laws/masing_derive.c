    {
        const double beta = fabs(s->beta_per_s);
        const double omega = fabs(s->omega_per_s);
        const double speed = (beta * beta) + (omega * omega);
        p->e = ((s->alpha * beta) / speed) * per_scale;
        p->h = ((s->alpha * omega) / speed) * per_scale;
        p->half_play = 0.5 * s->reversal_play_rad;
    }
